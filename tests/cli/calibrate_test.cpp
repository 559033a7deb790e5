// Pictures of a board become a rig: what is refused, and that nothing is left then.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <string>

#include "base/image_file.h"
#include "tests/calib/board_scene.h"
#include "tests/cli/command.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

class Calibrate : public VerbTest {
 protected:
  static void SetUpTestSuite() {
    pictures_ = new TemporaryFolder;
    // A quarter of the picture's pixels, and the same view.
    StereoRig rig = true_rig();
    for (LensCamera* camera : {&rig.left, &rig.right}) camera->camera = camera->camera.resized(320, 240);
    BoardDescription const board = chessboard();
    auto const shade = [&](Eigen::Vector2d const& p) { return chessboard_shade(board, p); };
    for (char const* side : {"left", "right"}) fs::create_directories(pictures_->path() / side);
    for (std::size_t i = 0; i < kBoards; ++i) {
      CounterRandom random(12, i);
      Eigen::Isometry3d pose;
      do pose = random_pose(random, 0.5);
      while (!is_in_picture(rig.left, board, pose) || !is_in_picture(rig.right, board, rig.right_from_left * pose));
      auto const name = std::to_string(i) + ".png";
      write_file(pictures_->path() / "left" / name, encode_png(render_board(rig.left, pose, shade, {}, i)));
      write_file(pictures_->path() / "right" / name,
                 encode_png(render_board(rig.right, rig.right_from_left * pose, shade, {}, 100 + i)));
    }
  }
  static void TearDownTestSuite() {
    delete pictures_;
    pictures_ = nullptr;
  }
  static fs::path pictures() { return pictures_->path(); }
  /// The test's own, to be damaged.
  fs::path copy() const {
    fs::copy(pictures(), in("copy"), fs::copy_options::recursive);
    return in("copy");
  }
  std::vector<std::string> arguments(fs::path const& from, std::string const& board = "9x6") const {
    return {"calibrate",
            "--left",
            (from / "left").string(),
            "--right",
            (from / "right").string(),
            "--board",
            board,
            "--square",
            "25",
            "-o",
            in("out/rig.yml"),
            "--quiet"};
  }
  /// `calibrate` must fail with this code and words, and leave nothing.
  void expect_refused(std::vector<std::string> const& arguments, int code, std::string const& words,
                      std::function<void()> const& limit = {}) const {
    fs::create_directories(in("out"));
    CommandResult const result = run_scanview(arguments, limit);
    EXPECT_EQ(result.exit_code, code) << result.errors;
    EXPECT_NE(result.errors.find(words), std::string::npos) << result.errors;
    EXPECT_TRUE(fs::is_empty(in("out")));
  }

  static constexpr int kBoards = 6;

 private:
  inline static TemporaryFolder* pictures_ = nullptr;
};

TEST_F(Calibrate, WritesARigThatReadsBack) {
  fs::create_directories(in("out"));
  auto words = arguments(pictures());
  words.pop_back();  // run says it
  Json const report = run(words);
  ASSERT_TRUE(report.contains("output"));
  EXPECT_EQ(report["output"], in("out/rig.yml"));
  StereoRig const rig = read_stereo_rig(in("out/rig.yml"));
  EXPECT_EQ(rig.left.camera.width(), 320);
  // Six boards of 320 × 240: what the calibration itself says of its baseline, five deviations.
  double const sigma = rig.standard_deviations.at("translation.x");
  EXPECT_LT(sigma, 2);
  EXPECT_NEAR(rig.right_from_left.translation().x(), true_rig().right_from_left.translation().x(), 5 * sigma);
  EXPECT_TRUE(fs::exists(in("out/rig.html")));
}

TEST_F(Calibrate, AWrongBoardIsRefusedInWords) {
  // One pair is enough: a board that is not there is searched for longest.
  for (char const* side : {"left", "right"}) {
    fs::create_directories(fs::path(in("one")) / side);
    fs::copy(pictures() / side / "0.png", fs::path(in("one")) / side);
  }
  for (char const* board : {"7x5", "11x8", "charuco:9x6"}) {
    SCOPED_TRACE(board);
    auto words = arguments(in("one"), board);
    if (std::string(board).rfind("charuco", 0) == 0) {
      for (char const* more : {"--marker", "18", "--dictionary", "DICT_4X4_50"}) words.emplace_back(more);
    }
    expect_refused(words, 4, "no picture shows a board of");
  }
  expect_refused(arguments(in("one"), "9y6"), 2, "9y6");
}

TEST_F(Calibrate, AnUnreadablePictureIsNamedAndNothingIsWritten) {
  fs::path const broken = copy(), picture = broken / "right/3.png";
  std::string const bytes = read_file(picture);
  write_file(picture, bytes.substr(0, bytes.size() / 2));
  expect_refused(arguments(broken), 3, "right/3.png: is truncated");
  write_file(picture, "");
  expect_refused(arguments(broken), 3, "right/3.png: is empty");
  write_file(picture, "no picture at all, whatever it is called");
  expect_refused(arguments(broken), 3, "right/3.png: ");
  fs::remove_all(broken / "right");
  expect_refused(arguments(broken), 3, "right");
}

TEST_F(Calibrate, AFullDiskLeavesNothing) {
  expect_refused(arguments(pictures()), 5, "cannot write", [] {
    std::signal(SIGXFSZ, SIG_IGN);
    rlimit const size{600, 600};
    ::setrlimit(RLIMIT_FSIZE, &size);
  });
}

}  // namespace
}  // namespace scanview
