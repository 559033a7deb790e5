#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "acquire/scan_set_file.h"
#include "base/files.h"
#include "base/image_file.h"
#include "synth/capture_files.h"
#include "synth/chessboard.h"
#include "synth/sensor.h"
#include "tests/synth/shapes.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector2d;
using Eigen::Vector3d;

TEST(Sensor, NoiseHasTheVarianceOfShotReadAndRounding) {
  SensorOptions options;
  constexpr int kRow = 1000, kRows = 200;
  for (double const electrons : {800.0, 3000.0, 10000.0})
    for (double const read : {0.0, 10.0, 40.0})
      for (double const light : {0.1, 0.4, 0.8}) {
        options.full_scale_electrons = electrons;
        options.read_electrons = read;
        Sensor const sensor(options);
        std::vector<float> const row(kRow, static_cast<float>(light));
        std::vector<uchar> values(kRow);
        double sum = 0, squares = 0;
        for (std::uint64_t r = 0; r < kRows; ++r) {
          sensor.expose(row.data(), kRow, CounterRandom(7, 3, r), values.data());
          for (uchar const value : values) sum += value, squares += 1.0 * value * value;
        }
        constexpr double kCount = 1.0 * kRow * kRows;
        double const mean = sum / kCount, variance = squares / kCount - mean * mean;
        double const scale = 255 / electrons;
        double const expected = scale * scale * (light * electrons + read * read) + 1.0 / 12;
        if (light * electrons < 5 * std::sqrt(light * electrons + read * read) ||
            (1 - light) * 255 < 5 * std::sqrt(expected) || expected < 0.3)
          continue;  // cut at black or white; or finer than a step, where rounding errors are not uniform
        // Five standard deviations of a mean and of a normal distribution's variance.
        EXPECT_NEAR(mean, 255 * light, 5 * std::sqrt(expected / kCount)) << electrons << ' ' << read << ' ' << light;
        EXPECT_NEAR(variance / expected, 1, 5 * std::sqrt(2 / kCount)) << electrons << ' ' << read << ' ' << light;
      }
}

TEST(Sensor, WithoutNoiseAValueIsTheRoundedLightAndGammaBendsIt) {
  SensorOptions options;
  options.full_scale_electrons = 0;
  options.bits = 16;
  options.gamma = 2.2;
  Sensor const sensor(options);
  std::vector<float> const light = {-1, 0, 0.25f, 1, 3};
  std::vector<ushort> values(5);
  sensor.expose(light.data(), 5, CounterRandom(1, 1), values.data());
  EXPECT_EQ(values[0], 0);
  EXPECT_EQ(values[1], 0);
  EXPECT_NEAR(values[2], 65535 * std::pow(0.25, 1 / 2.2), 0.6);
  EXPECT_EQ(values[3], 65535);
  EXPECT_EQ(values[4], 65535);
}

TEST(GrayCode, PatternAndInverseSpellTheColumnMostSignificantBitFirst) {
  TriangleMesh const ball = make_icosphere(Vector3d::Zero(), 40, 2);
  CaptureOptions options;
  options.light.pattern = LightOptions::Pattern::gray;
  options.light.projector_width = 300;
  options.light.projector_height = 200;
  options.light.rows = true;
  CaptureLayout const layout = make_layout(centered(ball), options);
  ProjectedLight const light(layout, options, 1);
  ASSERT_EQ(light.frames(), 2 * 9 + 2 * 8 + 2);
  EXPECT_EQ(light.frame_name(0), "0000");
  EXPECT_EQ(light.frame_name(33), "0033");
  EXPECT_EQ(light.frame_name(34), "white");
  EXPECT_EQ(light.frame_name(35), "black");
  auto const number = [](std::vector<float> const& frames, int first, int bits) {
    int value = 0, bit = 0;
    for (int k = 0; k < bits; ++k) {
      float const pattern = frames[first + 2 * k], inverse = frames[first + 2 * k + 1];
      EXPECT_NEAR(pattern + inverse, 1, 1e-4);
      bit ^= pattern > inverse ? 1 : 0;
      value = 2 * value + bit;
    }
    return value;
  };
  for (int column = 5; column < 295; ++column) {
    int const row = column % 190 + 5;
    std::vector<float> frames(36, 0.0f);
    light.add({static_cast<float>(column), static_cast<float>(row)}, 1, frames.data());
    EXPECT_EQ(number(frames, 0, 9), column);
    EXPECT_EQ(number(frames, 18, 8), row);
    EXPECT_EQ(frames[34], 1);
    EXPECT_EQ(frames[35], 0);
  }
  // The projector's picture holds the whole object.
  for (auto const& vertex : ball.vertices) {
    LightPoint const at = light.at(layout.room_from_object[0] * vertex.cast<double>());
    EXPECT_GT(at.column, 0);
    EXPECT_LT(at.column, 299);
    EXPECT_GT(at.row, 0);
    EXPECT_LT(at.row, 199);
  }
}

TEST(Chessboard, CornersAreWhereTheRigProjectsThem) {
  TriangleMesh const ball = make_icosphere(Vector3d::Zero(), 40, 2);
  CaptureOptions options;
  options.sensor.full_scale_electrons = 0;
  CaptureLayout const layout = make_layout(centered(ball), options);
  double const distance = (layout.room_from_left.translation() - layout.target).norm();
  BoardPoses const poses = make_board_poses(layout.rig, distance, 12, 1);
  ASSERT_EQ(poses.left_from_board.size(), 12u);
  Context context;
  double least_u = 1e9, most_u = 0, most_tilt = 0;
  for (std::size_t i : {0u, 5u, 11u}) {
    auto const pictures = take_board(layout.rig, poses, i, Sensor(options.sensor), context);
    for (std::size_t side = 0; side < 2; ++side) {
      LensCamera const& camera = side == 0 ? layout.rig.left : layout.rig.right;
      std::vector<cv::Point2f> truth;
      for (int row = 0; row < 6; ++row)
        for (int column = 0; column < 9; ++column) {
          Vector3d const p = poses.left_from_board[i] * poses.board.corner(column, row);
          Vector2d const pixel = camera.project(side == 0 ? p : layout.rig.right_from_left * p);
          truth.emplace_back(static_cast<float>(pixel.x()), static_cast<float>(pixel.y()));
        }
      auto found = truth;
      cv::cornerSubPix(pictures[side], found, {4, 4}, {-1, -1}, {cv::TermCriteria::EPS, 50, 1e-4});
      cv::Point2f mean(0, 0);
      for (std::size_t c = 0; c < truth.size(); ++c) {
        // The detector itself is good to some hundredths of a pixel; a wrong pixel convention would show half a pixel.
        EXPECT_LT(cv::norm(found[c] - truth[c]), 0.15) << i << ' ' << side << ' ' << c;
        mean += (found[c] - truth[c]) / 54;
      }
      EXPECT_LT(cv::norm(mean), 0.03);
    }
  }
  for (auto const& pose : poses.left_from_board) {
    double const u = layout.rig.left.project(pose * poses.board.center()).x();
    least_u = std::min(least_u, u), most_u = std::max(most_u, u);
    most_tilt = std::max(most_tilt, std::acos(pose.linear().col(2).z()) * 180 / std::numbers::pi);
  }
  EXPECT_GT(most_u - least_u, 640 / 4);
  EXPECT_GT(most_tilt, 20);
}

TEST(CaptureFiles, AWholeSmallCaptureStandsOnDisk) {
  TemporaryFolder const folder;
  TriangleMesh const ball = make_icosphere({3, 4, 5}, 40, 3);
  CaptureOptions options;
  options.views = 2;
  options.width = 64;
  options.height = 48;
  options.light.steps = 24;
  options.boards = 2;
  Context context;
  CaptureRig const rig(ball, options, context);
  write_capture(folder.path(), ball, rig, context);
  Json const manifest = read_json(folder.path() / "capture.json");
  EXPECT_EQ(manifest["pattern"], "sweep");
  EXPECT_EQ(manifest["views"], Json::parse(R"(["view_{:03d}", 0, 1])"));
  EXPECT_EQ(manifest["last"], 23);
  for (char const* name : {"view_000", "view_001", "empty"}) {
    for (char const* side : {"left", "right"}) {
      for (int k : {0, 23}) {
        cv::Mat const frame = read_image(folder.path() / name / side / (k == 0 ? "0000.png" : "0023.png"));
        EXPECT_EQ(frame.type(), CV_8U);
        EXPECT_EQ(frame.size(), cv::Size(64, 48));
      }
      EXPECT_FALSE(fs::exists(folder.path() / name / side / "0024.png"));
    }
    EXPECT_EQ(read_image(folder.path() / name / "left_color.png").type(), CV_8UC3);
  }
  StereoRig const read = read_stereo_rig(folder.path() / "rig.yml");
  EXPECT_EQ(read.left.lens, rig.layout().rig.left.lens);
  EXPECT_EQ(read.left.camera, rig.layout().rig.left.camera);
  EXPECT_TRUE(read.right_from_left.isApprox(rig.layout().rig.right_from_left, 1e-12));
  EXPECT_EQ(read_json(folder.path() / "boards/boards.json")["poses"].size(), 2u);
  EXPECT_EQ(read_image(folder.path() / "boards/right/01.png").size(), cv::Size(64, 48));

  ScanSet const truth = read_manifest(folder.path() / "truth");
  ASSERT_EQ(truth.views.size(), 2u);
  TriangleMesh const model = read_triangle_mesh(folder.path() / "truth/model.ply");
  cv::Mat1f const depth = read_depth_exr(folder.path() / "truth/001.exr");
  cv::Mat1f const again = true_depth(model, *truth.views[1].object_from_camera, truth.views[1].image.camera, context);
  int seen = 0;
  for (int i = 0; i < static_cast<int>(depth.total()); ++i)
    if (std::isfinite(depth(i)) && std::isfinite(again(i))) {
      EXPECT_NEAR(depth(i), again(i), 1e-3);
      ++seen;
    }
  EXPECT_GT(seen, 400);
  // The ball's surface is 40 away from its centre, which the files say where to find.
  Vector3d const p = *truth.views[1].object_from_camera * truth.views[1].image.camera.unproject(32, 24, depth(24, 32));
  EXPECT_NEAR((p - Vector3d(3, 4, 5)).norm(), 40, 0.5);
  EXPECT_GT(cv::countNonZero(read_image(folder.path() / "truth/visible_001.png")), 200);
}

}  // namespace
}  // namespace scanview
