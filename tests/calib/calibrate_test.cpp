#include "calib/calibrate.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <map>

#include "base/parallel.h"
#include "calib/calibrate_problem.h"
#include "tests/calib/board_scene.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

using ::testing::HasSubstr;
using Status = Calibration::Status;

Calibration solve_scene(BoardScene const& scene) {
  Context context;
  return calibrate(scene.views, scene.options, context);
}

std::string why(Calibration const& calibration, std::string const& name) {
  for (NamedReason const& out : calibration.boards_rejected())
    if (out.name == name) return out.why;
  return "";
}

std::map<std::string, double> true_values(StereoRig const& rig) {
  Estimate truth;
  for (auto const& [at, camera] : {std::pair{0, &rig.left}, {kRight, &rig.right}})
    truth.shared.segment<kLensUnknowns>(at) << camera->camera.fx(), camera->camera.fy(), camera->camera.cx(),
        camera->camera.cy(), camera->lens.k1, camera->lens.k2, camera->lens.p1, camera->lens.p2, camera->lens.k3;
  truth.shared.segment<6>(kRotation) = to_vector(rig.right_from_left);
  std::map<std::string, double> values;
  for (int k = 0; k < kShared; ++k) values[shared_name(k)] = truth.shared[k];
  return values;
}

TEST(Calibrate, BoardsParallelToThePictureAreRefused) {
  Calibration const result = solve_scene(board_scene(1, 8, 0));
  EXPECT_EQ(result.status, Status::parallel_boards);
  EXPECT_THAT(result.reason, HasSubstr("parallel"));
}

TEST(Calibrate, FewerThanThreeBoardsAreRefused) {
  Calibration const result = solve_scene(board_scene(2, 2));
  EXPECT_EQ(result.status, Status::too_few_boards);
  EXPECT_THAT(result.reason, HasSubstr("2 boards"));
}

TEST(Calibrate, BoardsThatNoTwoCamerasShareGiveNoRig) {
  BoardScene scene = board_scene(3, 8);
  for (std::size_t i = 0; i < scene.views.size(); ++i) (i % 2 ? scene.views[i].left : scene.views[i].right).clear();
  Calibration const result = solve_scene(scene);
  EXPECT_EQ(result.status, Status::too_few_boards);
  EXPECT_THAT(result.reason, HasSubstr("both cameras"));
}

TEST(Calibrate, TheMirroredPictureIsNamed) {
  BoardScene scene = board_scene(4);
  scene.views[5].right = mirrored(scene.views[5].right, scene.options.board, 640);
  Calibration const result = solve_scene(scene);
  ASSERT_EQ(result.status, Status::solved) << result.reason;
  EXPECT_EQ(result.boards_used(), 11U);
  EXPECT_THAT(why(result, "board5"), HasSubstr("right picture is mirrored"));
}

TEST(Calibrate, ACameraWhosePicturesAreAllMirroredIsNamed) {
  BoardScene scene = board_scene(5);
  for (BoardView& view : scene.views) view.left = mirrored(view.left, scene.options.board, 640);
  Calibration const result = solve_scene(scene);
  EXPECT_EQ(result.status, Status::inconsistent);
  EXPECT_THAT(result.reason, HasSubstr("mirrored"));
}

TEST(Calibrate, ABoardThatMovedBetweenTheShotsGoes) {
  BoardScene scene = board_scene(6);
  // 1.5 mm at 400 mm: 2 px, 25 deviations of a corner.
  CounterRandom random(6, 100);
  Eigen::Isometry3d moved = scene.poses[3];
  moved.translation() += Eigen::Vector3d(0.6, 1.5, 1);
  scene.views[3].right = see(scene.rig.right, scene.rig.right_from_left * moved, scene.options.board, 0.08, random);
  Calibration const result = solve_scene(scene);
  ASSERT_EQ(result.status, Status::solved) << result.reason;
  EXPECT_EQ(result.boards_used(), 11U);
  EXPECT_THAT(why(result, "board3"), HasSubstr("moved between the two shots"));
}

TEST(Calibrate, ThePictureThatLiesIsNamed) {
  BoardScene scene = board_scene(7);
  // A bend of 1.5 px from the middle to the ends: no homography has it.
  for (BoardCorner& corner : scene.views[2].left) {
    double const u = (corner.id % 9 - 4) / 4.0;
    corner.pixel.y() += 1.5 * u * u * u * u;
  }
  Calibration const result = solve_scene(scene);
  ASSERT_EQ(result.status, Status::solved) << result.reason;
  EXPECT_EQ(result.boards_used(), 11U);
  EXPECT_THAT(why(result, "board2"), HasSubstr("left picture"));
}

TEST(Calibrate, OneWrongCornerGoesAlone) {
  BoardScene scene = board_scene(8);
  scene.views[4].left[10].pixel += Eigen::Vector2d(4, -3);
  Calibration const result = solve_scene(scene);
  ASSERT_EQ(result.status, Status::solved) << result.reason;
  EXPECT_EQ(result.boards_used(), 12U);
  EXPECT_EQ(result.corners_rejected, 1U);
  EXPECT_FALSE(result.boards[4].left[10].used);
}

TEST(Calibrate, GoodBoardsAllStay) {
  for (std::uint64_t seed = 20; seed < 24; ++seed) {
    Calibration const result = solve_scene(board_scene(seed));
    ASSERT_EQ(result.status, Status::solved) << seed;
    EXPECT_EQ(result.boards_used(), 12U) << seed;
    // 1300 corners beyond six deviations: one in 10^5 runs.
    EXPECT_EQ(result.corners_rejected, 0U) << seed;
    // Two coordinates of 0.08 px, less the share of 24 + 72 unknowns in 2600 numbers; the RMS of so many is within 2 %.
    EXPECT_NEAR(result.rms_px, 0.08 * std::sqrt(2.0 * (1 - 96.0 / 2592)), 0.06 * 0.113) << seed;
  }
}

TEST(Calibrate, ErrorsAreWhatTheStandardDeviationsSay) {
  std::map<std::string, double> squares, counts;
  int const seeds = 50;
  std::vector<Calibration> results(seeds);
  Context context;
  for_each_index(context, results.size(), [&](std::size_t i) { results[i] = solve_scene(board_scene(1000 + i)); });
  for (int seed = 0; seed < seeds; ++seed) {
    BoardScene const scene = board_scene(1000 + static_cast<std::uint64_t>(seed));
    Calibration const& result = results[static_cast<std::size_t>(seed)];
    ASSERT_EQ(result.status, Status::solved) << result.reason;
    auto const truth = true_values(scene.rig);
    for (Parameter const& p : result.parameters) {
      double const ratio = (p.value - truth.at(p.name)) / p.std;
      squares[p.name] += ratio * ratio;
      counts[p.name] += 1;
    }
  }
  EXPECT_EQ(squares.size(), static_cast<std::size_t>(kShared));
  // The RMS of 50 standard normals is 1 +- 0.1: 0.7 and 1.4 are three and four deviations away.
  for (auto const& [name, sum] : squares) {
    double const rms = std::sqrt(sum / counts[name]);
    EXPECT_GT(rms, 0.7) << name << " in " << counts[name];
    EXPECT_LT(rms, 1.4) << name << " in " << counts[name];
  }
}

TEST(Calibrate, ABoardInOnePictureHelpsItsCamera) {
  BoardScene scene = board_scene(9, 16);
  std::vector<BoardView> const all = scene.views;
  for (std::size_t i = 6; i < scene.views.size(); ++i) scene.views[i].right.clear();
  Calibration const more = solve_scene(scene);
  scene.views.resize(6);
  Calibration const fewer = solve_scene(scene);
  ASSERT_TRUE(more.solved() && fewer.solved());
  EXPECT_EQ(more.boards_used(), 16U);
  // Sixteen views instead of six: 0.6 of the deviation.
  EXPECT_LT(more.rig.standard_deviations.at("left.fx"), 0.8 * fewer.rig.standard_deviations.at("left.fx"));
}

TEST(Calibrate, DistortionThatTheImagesDoNotDetermineIsHeldAndNamed) {
  BoardScene scene = board_scene(10, 8);
  scene.rig.left.lens = scene.rig.right.lens = {};
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    // Far away, in the middle of the picture: a tenth of it, where k3's part of the displacement is nothing.
    CounterRandom random(10, 200 + i);
    Eigen::Isometry3d pose = scene.poses[i];
    pose.translation() = Eigen::Vector3d(120, 0, 1600) - pose.linear() * Eigen::Vector3d(100, 62.5, 0);
    scene.views[i].left = see(scene.rig.left, pose, scene.options.board, 0.02, random);
    scene.views[i].right = see(scene.rig.right, scene.rig.right_from_left * pose, scene.options.board, 0.02, random);
  }
  Calibration const result = solve_scene(scene);
  ASSERT_EQ(result.status, Status::solved) << result.reason;
  std::vector<std::string> held;
  for (NamedReason const& h : result.held) held.push_back(h.name);
  EXPECT_THAT(held, ::testing::IsSupersetOf({"left.k3", "right.k3"}));
  EXPECT_EQ(result.rig.left.lens.k3, 0);
  EXPECT_FALSE(result.rig.standard_deviations.contains("left.k3"));
}

TEST(Calibrate, AScaleOfTheBoardIsAScaleOfTheRig) {
  BoardScene scene = board_scene(11);
  Calibration const millimetres = solve_scene(scene);
  scene.options.board.square /= 1000;
  scene.options.unit = "m";
  Calibration const metres = solve_scene(scene);
  ASSERT_TRUE(millimetres.solved() && metres.solved());
  EXPECT_NEAR(metres.rig.baseline() * 1000, millimetres.rig.baseline(), 1e-4);
  EXPECT_EQ(metres.rig.unit, "m");
}

TEST(Calibrate, HoldoutIsTheSameForAnyNumberOfThreads) {
  BoardScene scene = board_scene(12, 8);
  scene.options.holdout = CalibrateOptions::Holdout::on;
  Context one, four;
  one.threads = 1;
  four.threads = 4;
  Calibration const a = calibrate(scene.views, scene.options, one), b = calibrate(scene.views, scene.options, four);
  EXPECT_EQ(a.to_json().dump(), b.to_json().dump());
  // An epipolar distance is one coordinate of each picture (0.08 px times sqrt 2), and the rig's own error comes on
  // top.
  EXPECT_GT(a.holdout_epipolar_rms_px, 0.08);
  EXPECT_LT(a.holdout_epipolar_rms_px, 0.2);
}

TEST(Calibrate, OneCameraAloneIsCalibratedAndItsFileIsNoRig) {
  BoardScene scene = board_scene(13);
  for (BoardView& view : scene.views) view.right.clear();
  scene.options.right_size = {};
  Calibration const result = solve_scene(scene);
  ASSERT_EQ(result.status, Status::solved) << result.reason;
  EXPECT_FALSE(result.stereo);
  EXPECT_EQ(result.parameters.size() + result.held.size(), static_cast<std::size_t>(kLensUnknowns));
  TemporaryFolder const folder;
  write_calibration(folder.path() / "camera.yml", result);
  EXPECT_SCANVIEW_ERROR(read_stereo_rig(folder.path() / "camera.yml"), ErrorCode::bad_input, "M2");
}

TEST(Calibrate, BoardsThatLookTheSameTurnedAreMatched) {
  BoardScene scene = board_scene(14);
  scene.options.board = parse_board("9x7", 22, 0, "");
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    CounterRandom random(14, 300 + i);
    scene.views[i].left = see(scene.rig.left, scene.poses[i], scene.options.board, 0.05, random);
    scene.views[i].right =
        see(scene.rig.right, scene.rig.right_from_left * scene.poses[i], scene.options.board, 0.05, random);
    if (scene.views[i].right.size() != 63) scene.views[i].right.clear();
    if (scene.views[i].left.size() != 63) scene.views[i].left.clear();
    if (i % 3 == 0)
      for (BoardCorner& corner : scene.views[i].right) corner.id = 62 - corner.id;
  }
  Calibration const result = solve_scene(scene);
  ASSERT_EQ(result.status, Status::solved) << result.reason;
  for (BoardFit const& board : result.boards) EXPECT_TRUE(board.used || board.left.empty()) << board.why;
}

}  // namespace
}  // namespace scanview
