#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/aruco.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/image_file.h"
#include "calib/board_pictures.h"
#include "tests/calib/board_scene.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using Layout = BoardDescription::Layout;

cv::Mat1b chessboard_picture(std::uint64_t seed, PictureNoise const& noise, Eigen::Isometry3d& pose) {
  CounterRandom random(seed, 0);
  BoardDescription const board = chessboard();
  do pose = random_pose(random, 0.5);
  while (!is_in_picture(true_rig().left, board, pose));
  return render_board(
      true_rig().left, pose, [&](auto const& p) { return chessboard_shade(board, p); }, noise, seed);
}

TEST(DetectBoard, AWrongBoardIsNotFoundInALargerOne) {
  Eigen::Isometry3d pose;
  cv::Mat1b const picture = chessboard_picture(3, {}, pose);
  for (char const* const wrong : {"8x6", "9x5", "8x5", "7x6"}) {
    DetectedBoard const found = detect_board(picture, parse_board(wrong, 25, 0, ""));
    EXPECT_FALSE(found.found()) << wrong;
    EXPECT_FALSE(found.why.empty()) << wrong;
  }
}

TEST(DetectBoard, NothingIsFoundInNoise) {
  cv::Mat1b picture(240, 320);
  CounterRandom random(4, 0);
  for (uchar& value : picture) value = static_cast<uchar>(random.below(256));
  EXPECT_THAT(detect_board(picture, chessboard()).why, HasSubstr("no chessboard of 9x6"));
}

TEST(DetectBoard, CornersAreAsPreciseAsTheySay) {
  double squares = 0, square_sigmas = 0, count = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::uint64_t seed = 10; seed < 13; ++seed) {
    Eigen::Isometry3d pose;
    DetectedBoard const found = detect_board(chessboard_picture(seed, {0.8, 2}, pose), chessboard());
    ASSERT_EQ(found.corners.size(), 54U) << found.why;
    for (BoardCorner const& corner : found.corners) {
      Eigen::Vector2d const p = chessboard().corner(corner.id);
      Eigen::Vector2d const error = corner.pixel - true_rig().left.project(pose * Eigen::Vector3d(p.x(), p.y(), 0));
      EXPECT_LT(error.norm(), 0.1) << corner.id;
      sum += error;
      squares += error.squaredNorm() / 2;
      square_sigmas += corner.sigma_px * corner.sigma_px;
      count += 1;
    }
  }
  // 324 coordinates of about 0.01 px: their mean within 0.001, so 0.02 is a bias; their RMS within 4 % but for what
  // the quadratic warp leaves of the lens.
  EXPECT_LT((sum / count).norm(), 0.02);
  EXPECT_LT(std::sqrt(squares / square_sigmas), 1.4);
  EXPECT_GT(std::sqrt(squares / square_sigmas), 0.7);
}

TEST(DetectBoard, SixteenBitsAndColourGiveTheSameCorners) {
  Eigen::Isometry3d pose;
  cv::Mat1b const gray = chessboard_picture(5, {}, pose);
  cv::Mat deep, color;
  gray.convertTo(deep, CV_16U, 257);
  cv::cvtColor(gray, color, cv::COLOR_GRAY2BGR);
  DetectedBoard const expected = detect_board(gray, chessboard());
  ASSERT_TRUE(expected.found());
  for (cv::Mat const& other : {deep, color}) {
    DetectedBoard const found = detect_board(other, chessboard());
    ASSERT_EQ(found.corners.size(), expected.corners.size());
    for (std::size_t i = 0; i < found.corners.size(); ++i)
      EXPECT_LT((found.corners[i].pixel - expected.corners[i].pixel).norm(), 1e-3);
  }
}

// A ChArUco board straight ahead, `cell` pixels a square.
cv::Mat1b charuco_picture(BoardDescription const& board, Layout layout, int cell) {
  auto const dictionary = cv::aruco::getPredefinedDictionary(cv::aruco::DICT_5X5_1000);
  int const border = cell, marker = static_cast<int>(std::lround(cell * board.marker / board.square));
  cv::Mat1b picture(board.rows * cell + 2 * border, board.columns * cell + 2 * border, uchar(230));
  bool const marker_first = layout == Layout::old && board.rows % 2 == 0;
  int id = 0;
  for (int y = 0; y < board.rows; ++y)
    for (int x = 0; x < board.columns; ++x) {
      cv::Rect const square(border + x * cell, border + y * cell, cell, cell);
      if (((x + y) % 2 == 0) != marker_first) {
        picture(square).setTo(30);
        continue;
      }
      cv::Mat1b drawn;
      cv::aruco::drawMarker(dictionary, id++, marker, drawn);
      drawn.setTo(30, drawn < 128);
      drawn.setTo(230, drawn >= 128);
      drawn.copyTo(picture(cv::Rect(square.x + (cell - marker) / 2, square.y + (cell - marker) / 2, marker, marker)));
    }
  cv::GaussianBlur(picture, picture, {}, 0.7);
  return picture;
}

TEST(DetectBoard, BothLayoutsOfCharucoAreRecognised) {
  BoardDescription const board = parse_board("charuco:9x6", 7.5, 5.6, "DICT_5X5_1000");
  for (Layout const layout : {Layout::old, Layout::current}) {
    DetectedBoard const found = detect_board(charuco_picture(board, layout, 40), board);
    ASSERT_EQ(found.corners.size(), 40U) << found.why;
    EXPECT_EQ(found.layout, layout);
    // Corner (0, 0) lies between pixels: the edge of a square of 40 pixels after a border of 40.
    for (BoardCorner const& corner : found.corners) {
      Eigen::Vector2d const expected = board.corner(corner.id) / board.square * 40 + Eigen::Vector2d(79.5, 79.5);
      EXPECT_LT((corner.pixel - expected).norm(), 0.03) << corner.id;
    }
  }
}

TEST(DetectBoard, APartOfACharucoBoardIsEnough) {
  BoardDescription board = parse_board("charuco:9x6", 7.5, 5.6, "DICT_5X5_1000");
  cv::Mat1b picture = charuco_picture(board, Layout::current, 40);
  picture.colRange(0, 200).setTo(128);
  DetectedBoard const found = detect_board(picture, board);
  EXPECT_GE(found.corners.size(), 15U);
  EXPECT_LT(found.corners.size(), 40U);
}

TEST(DetectBoard, AMirroredCharucoBoardSaysSo) {
  BoardDescription const board = parse_board("charuco:9x6", 7.5, 5.6, "DICT_5X5_1000");
  cv::Mat mirror;
  cv::flip(charuco_picture(board, Layout::current, 40), mirror, 1);
  EXPECT_THAT(detect_board(mirror, board).why, HasSubstr("flipped"));
}

TEST(DetectBoard, DescriptionsThatMakeNoSenseAreRefused) {
  EXPECT_SCANVIEW_ERROR(parse_board("9by6", 25, 0, ""), ErrorCode::usage, "9by6");
  EXPECT_SCANVIEW_ERROR(parse_board("9x6", 0, 0, ""), ErrorCode::usage, "square");
  EXPECT_SCANVIEW_ERROR(parse_board("charuco:9x6", 25, 30, "DICT_5X5_50"), ErrorCode::usage, "marker");
  EXPECT_SCANVIEW_ERROR(detect_board(cv::Mat1b(50, 50, uchar(0)), parse_board("charuco:9x6", 25, 20, "DICT_NONE")),
                        ErrorCode::usage, "DICT_NONE");
}

class BoardPicturesTest : public ::testing::Test {
 protected:
  fs::path add(std::string const& name, cv::Mat const& picture) {
    cv::imwrite((folder_.path() / name).string(), picture);
    return folder_.path() / name;
  }
  TemporaryFolder folder_;
};

TEST_F(BoardPicturesTest, PicturesOfTwoSizesAreNamed) {
  Eigen::Isometry3d pose;
  cv::Mat1b const picture = chessboard_picture(3, {}, pose);
  cv::Mat smaller;
  cv::resize(picture, smaller, {}, 0.9, 0.9, cv::INTER_AREA);
  std::vector<PicturePair> const pairs = {
      {"a", add("a.png", picture), {}}, {"b", add("b.png", picture), {}}, {"c", add("c.png", smaller), {}}};
  Context context;
  EXPECT_SCANVIEW_ERROR(detect_boards(pairs, chessboard(), context), ErrorCode::bad_input, "c.png");
}

TEST_F(BoardPicturesTest, APictureThatCannotBeReadIsNamed) {
  fs::path const path = folder_.path() / "broken.png";
  write_file(path, "no picture");
  Context context;
  EXPECT_SCANVIEW_ERROR(detect_boards({{"broken", path, {}}}, chessboard(), context), ErrorCode::bad_input,
                        "broken.png");
}

TEST(PairPictures, MissingPartnersAreNamed) {
  PicturePairs const paired = pair_pictures({"left01.png", "left02.png", "left04.png"}, {"right02.png", "right04.png"});
  ASSERT_EQ(paired.pairs.size(), 3U);
  EXPECT_TRUE(paired.pairs[0].right.empty());
  EXPECT_EQ(paired.pairs[1].right, "right02.png");
  ASSERT_EQ(paired.unpaired.size(), 1U);
  EXPECT_THAT(paired.unpaired[0], HasSubstr("left01.png has no right partner"));
}

TEST(PairPictures, UnequalCountsWithoutNumbersAreRefused) {
  EXPECT_SCANVIEW_ERROR(pair_pictures({"a.png", "b.png"}, {"c.png"}), ErrorCode::usage, "2 left and 1 right");
  EXPECT_EQ(pair_pictures({"a.png", "b.png"}, {"c.png", "d.png"}).pairs[1].right, "d.png");
}

TEST(PairPictures, AnUnnumberedPictureBesideNumberedOnesIsLeftOut) {
  PicturePairs const paired = pair_pictures({"left.jpg", "left01.jpg", "left02.jpg", "left03.jpg"},
                                            {"right.jpg", "right01.jpg", "right02.jpg", "right03.jpg"});
  EXPECT_EQ(paired.pairs.size(), 3U);
  EXPECT_EQ(paired.unpaired.size(), 2U);
}

TEST(RealBoards, OpenCvsOwnPairs) {
  fs::path const folder = "/usr/share/doc/opencv-doc/examples/data";
  if (!fs::exists(folder / "left01.jpg")) GTEST_SKIP() << "package opencv-doc is not installed";
  std::vector<PicturePair> pairs;
  for (char const* const number : {"01", "03", "05", "07", "09"})
    pairs.push_back(
        {number, folder / (std::string("left") + number + ".jpg"), folder / (std::string("right") + number + ".jpg")});
  Context context;
  BoardPictures const pictures = detect_boards(pairs, chessboard(), context);
  CalibrateOptions options;
  options.board = pictures.board;
  options.left_size = pictures.left_size;
  options.right_size = pictures.right_size;
  Calibration const result = calibrate(pictures.views, options, context);
  ASSERT_TRUE(result.solved()) << result.reason;
  EXPECT_EQ(result.boards_used(), 5U);
  EXPECT_EQ(result.corners, 540U);
  EXPECT_LT(result.rms_px, 0.24);
}

}  // namespace
}  // namespace scanview
