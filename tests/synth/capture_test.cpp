#include "synth/capture.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <opencv2/core.hpp>

#include "synth/interreflection.h"
#include "tests/expect_error.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// A square of side 80 that stands upright and faces +z.
TriangleMesh make_square() {
  TriangleMesh mesh;
  for (auto const& [x, y] : {std::pair{-40, -40}, {40, -40}, {40, 40}, {-40, 40}}) mesh.vertices.emplace_back(x, y, 0);
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

/// A small ball before a large one: it throws a shadow, and hides what is behind it.
TriangleMesh make_two_balls() {
  TriangleMesh mesh = make_icosphere(Vector3d::Zero(), 40, 4);
  TriangleMesh const small = make_icosphere({0, 5, 72}, 9, 3);
  int const first = static_cast<int>(mesh.vertices.size());
  mesh.vertices.insert(mesh.vertices.end(), small.vertices.begin(), small.vertices.end());
  for (auto const& t : small.triangles) mesh.triangles.emplace_back(t.array() + first);
  return mesh;
}

CaptureOptions small_capture() {
  CaptureOptions options;
  options.views = 1;
  options.width = 160;
  options.height = 120;
  options.light.steps = 48;
  options.scene.stage = false;
  options.scene.ambient = 0;
  options.sensor.full_scale_electrons = 0;
  options.sensor.bits = 16;
  options.boards = 0;
  return options;
}

bool same_bytes(cv::Mat const& a, cv::Mat const& b) {
  return a.size() == b.size() && a.type() == b.type() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

/// When a pixel was brightest: through the logarithms of three values of a Gaussian goes a parabola, exactly. NaN where
/// the brightest is too dark to tell or the first or last.
double peak_time(std::vector<cv::Mat> const& frames, int x, int y) {
  auto const value = [&](int k) { return static_cast<double>(frames[static_cast<std::size_t>(k)].at<ushort>(y, x)); };
  int best = 0;
  for (int k = 1; k < static_cast<int>(frames.size()); ++k)
    if (value(k) > value(best)) best = k;
  if (best == 0 || best + 1 == static_cast<int>(frames.size()) || value(best) < 2000) return std::nan("");
  double const before = std::log(value(best - 1)), at = std::log(value(best)), after = std::log(value(best + 1));
  return best + 0.5 * (before - after) / (before - 2 * at + after);
}

/// True where all truth about a pixel is the same for `reach` pixels around.
bool is_uniform(cv::Mat1b const& mask, int x, int y, int reach) {
  if (x < reach || y < reach || x + reach >= mask.cols || y + reach >= mask.rows) return false;
  for (int dy = -reach; dy <= reach; ++dy)
    for (int dx = -reach; dx <= reach; ++dx)
      if (mask(y + dy, x + dx) != mask(y, x)) return false;
  return true;
}

TEST(Capture, BrightnessOverTimePeaksWhenTheLightPlanePassesThePoint) {
  TriangleMesh const square = make_square();
  Context context;
  CaptureRig const rig(square, small_capture(), context);
  CaptureLayout const& layout = rig.layout();
  double const step = (layout.sweep_high - layout.sweep_low) / 48;
  Isometry3d const& object_pose = layout.room_from_object[0];
  for (auto const side : {CaptureSide::left, CaptureSide::right}) {
    CapturePictures const pictures = rig.take(0, side, context);
    Isometry3d const camera_pose = rig.room_from_camera(side);
    int compared = 0;
    double worst_mm = 0;
    for (int y = 0; y < 120; ++y)
      for (int x = 0; x < 160; ++x) {
        // Where the ray meets the square's plane.
        Vector3d const ray = camera_pose.linear() * rig.camera(side).ray(Vector2d(x, y));
        Vector3d const eye = camera_pose.translation(), normal = object_pose.linear().col(2);
        double const t = normal.dot(object_pose.translation() - eye) / normal.dot(ray);
        Vector3d const p = eye + t * ray, on_square = object_pose.inverse() * p;
        if (on_square.head<2>().cwiseAbs().maxCoeff() > 38) continue;  // more than a pixel (about 1 mm) from the border
        double const peak = peak_time(pictures.frames, x, y);
        ASSERT_TRUE(std::isfinite(peak)) << x << ' ' << y;
        double const angle = layout.sweep_low + (peak + 0.5) * step;
        Vector3d const q = layout.room_from_light.inverse() * p;
        worst_mm = std::max(worst_mm, std::abs(q.x() * std::cos(angle) - q.z() * std::sin(angle)));
        ++compared;
      }
    EXPECT_GT(compared, 3000);
    // A pixel of 1 mm is half a step wide here. Over it the light falls off by 1 %, which moves the mean by 1/12 of 1 %
    // of its width; rounding to 1/65535 of full scale moves the parabola's top by 1/30000 of a step.
    EXPECT_LT(worst_mm, 3e-3);
  }
}

TEST(Capture, WhatTheTruthCallsVisibleHasTheSameCodeInBothPictures) {
  TriangleMesh const balls = make_two_balls();
  Context context;
  CaptureRig const rig(balls, small_capture(), context);
  CaptureTruth const truth = rig.truth(0, context);
  std::array const pictures = {rig.take(0, CaptureSide::left, context), rig.take(0, CaptureSide::right, context)};
  Camera const ideal = ideal_left_camera(rig.layout().rig);
  Vector3d const left_eye = rig.layout().room_from_left.translation();
  Vector3d const right_eye = rig.layout().room_from_right().translation();
  Vector3d const lamp = rig.layout().room_from_light.translation();
  auto const meet = [&](double x, double y) {
    return rig.scene().meet(0, left_eye, rig.layout().room_from_left.linear() * ideal.ray_direction(x, y));
  };
  // The small one is but a few pixels wide.
  auto const is_on_large = [&](CaptureScene::ObjectPoint const& point) {
    return !std::isnan(point.distance) && (rig.layout().room_from_object[0].inverse() * point.point).norm() < 41;
  };
  int compared = 0, shadowed = 0;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x) {
      auto const hit = meet(x, y);
      if (!is_on_large(hit)) continue;
      Vector3d const p_left = ideal.unproject(x, y, hit.distance);
      bool all_large = true, all_dark = true;
      for (auto const& [dx, dy] : {std::pair{-2, -2}, {2, -2}, {-2, 2}, {2, 2}, {0, -2}, {0, 2}, {-2, 0}, {2, 0}}) {
        auto const near = meet(x + dx, y + dy);
        all_large &= is_on_large(near);
        all_dark &= is_on_large(near) && !rig.scene().is_open_to(0, near, lamp);
      }
      if (!all_large) continue;  // at an edge pixels mix two surfaces
      if (!rig.scene().is_open_to(0, hit, lamp)) {
        if (!all_dark) continue;
        Vector2d const pixel = rig.camera(CaptureSide::left).project(p_left);
        for (auto const& frame : pictures[0].frames)
          EXPECT_EQ(
              frame.at<ushort>(static_cast<int>(std::lround(pixel.y())), static_cast<int>(std::lround(pixel.x()))), 0);
        ++shadowed;
      }
      if (truth.visible(y, x) == 0 || !is_uniform(truth.visible, x, y, 3)) continue;
      // Not too slanted: towards the rim the code is no longer linear between pixels.
      if (hit.normal.dot((left_eye - hit.point).normalized()) < 0.8 ||
          hit.normal.dot((right_eye - hit.point).normalized()) < 0.8)
        continue;
      double const code = rig.light().at(hit.point).column;
      for (int side = 0; side < 2; ++side) {
        LensCamera const& camera = rig.camera(static_cast<CaptureSide>(side));
        Vector2d const pixel = camera.project(side == 0 ? p_left : rig.layout().rig.right_from_left * p_left);
        int const u = static_cast<int>(std::floor(pixel.x())), v = static_cast<int>(std::floor(pixel.y()));
        double const a = pixel.x() - u, b = pixel.y() - v;
        auto const peak = [&](int dx, int dy) {
          return peak_time(pictures[static_cast<std::size_t>(side)].frames, u + dx, v + dy);
        };
        double const seen =
            (1 - b) * ((1 - a) * peak(0, 0) + a * peak(1, 0)) + b * ((1 - a) * peak(0, 1) + a * peak(1, 1));
        // Linear interpolation is off by 1/8 of the second difference, where two facets meet by 1/4 of the change in
        // slope. Neighbouring facets differ by 0.07 rad, which at acos 0.8 is a change of 0.11 in slope; the code
        // follows depth by the tangent of the angle between camera and lamp, 0.25, and pixels by half a step a pixel:
        // 0.004. The cosine of shading falls by up to 3 % over a pixel: 1/12 of that. The parabola through a mixture
        // of beams as wide as a pixel adds as much again.
        EXPECT_NEAR(seen, code, 0.02) << side << ": " << x << ' ' << y;
      }
      ++compared;
    }
  EXPECT_GT(compared, 500);
  EXPECT_GT(shadowed, 50);
}

TEST(Capture, TruthIsTheDepthAlongTheIdealCamerasRays) {
  TriangleMesh const balls = make_two_balls();
  CaptureOptions options = small_capture();
  options.views = 7;  // two of them tilted
  Context context;
  CaptureRig const rig(balls, options, context);
  Camera const camera = ideal_left_camera(rig.layout().rig);
  for (int v : {0, 3, 5, 6}) {
    Isometry3d const object_from_left = rig.layout().object_from_left(static_cast<std::size_t>(v));
    cv::Mat1f const expected = true_depth(balls, object_from_left, camera, context);
    cv::Mat1f const depth = rig.truth(v, context).depth;
    int differ = 0, hits = 0;
    for (int i = 0; i < static_cast<int>(depth.total()); ++i) {
      float const a = depth(i), b = expected(i);
      if (std::isnan(a) && std::isnan(b)) continue;
      ++hits;
      // The same rays in coordinates that are rounded differently: another triangle at an edge at most.
      if (!(std::abs(a - b) < 1e-3)) ++differ;
    }
    EXPECT_GT(hits, 2000);
    EXPECT_LE(differ, 4) << v;
  }
}

TEST(Capture, TheObjectStaysInBothPicturesAndAboveTheTurntable) {
  TriangleMesh const balls = make_two_balls();
  CaptureOptions options = small_capture();
  options.views = 12;
  Context context;
  CaptureRig const rig(balls, options, context);
  for (auto const& pose : rig.layout().room_from_object)
    for (auto const& vertex : balls.vertices) {
      Vector3d const p = pose * vertex.cast<double>();
      EXPECT_GT(p.y(), 0);
      for (auto const side : {CaptureSide::left, CaptureSide::right}) {
        LensCamera const& camera = rig.camera(side);
        EXPECT_TRUE(camera.camera.contains(camera.project(rig.room_from_camera(side).inverse() * p)));
      }
      double const code = rig.light().at(p).column;
      // The sweep starts and ends with 4 standard deviations of the beam and more beside the object.
      EXPECT_GT(code, 4 * rig.light().beam_steps());
      EXPECT_LT(code, 47 - 4 * rig.light().beam_steps());
    }
}

TEST(Capture, TheLampStaysTheSameWhenItMakesMoreSteps) {
  TriangleMesh const square = make_square();
  Context context;
  CaptureOptions options = small_capture();
  for (int const steps : {24, 96, 192}) {
    options.light.steps = steps;
    EXPECT_NEAR(CaptureRig(square, options, context).light().beam_steps(), 0.8 * steps / 96, 1e-9);
  }
  options.light.beam_mm = 1;
  CaptureRig const rig(square, options, context);
  double const step = (rig.layout().sweep_high - rig.layout().sweep_low) / 192;
  EXPECT_NEAR(rig.light().beam_steps() * step * rig.layout().lamp_distance(), 1, 1e-9);
}

TEST(Capture, AmbientLightIsThereWhereTheBeamIsNotAndExposureScalesBoth) {
  TriangleMesh const square = make_square();
  Context context;
  CaptureOptions options = small_capture();
  CaptureRig const plain(square, options, context);
  options.scene.ambient = 0.1;
  options.sensor.exposure = 0.5;
  CaptureRig const lit(square, options, context);
  cv::Mat const with = lit.take(0, CaptureSide::left, context).frames[0];
  cv::Mat const without = plain.take(0, CaptureSide::left, context).frames[0];
  // The first frame's beam is beside the square: only the room's light is there.
  EXPECT_EQ(cv::countNonZero(without), 0);
  double brightest = 0;
  cv::minMaxLoc(with, nullptr, &brightest);
  double const full = 65535 * 0.5 * kPeakShare;  // of beam and ambient together
  EXPECT_GT(brightest, 0.03 * full);
  EXPECT_LT(brightest, 0.2 * full);
}

TEST(Capture, ASurfaceSquareToAnotherGetsHalfOfWhatThatOneSendsBack) {
  // Two squares that meet at right angles in a vertical edge and open towards the lamp.
  TriangleMesh groove;
  groove.vertices = {{0, -200, 0}, {0, 200, 0}, {283, -200, 283}, {283, 200, 283}, {-283, -200, 283}, {-283, 200, 283}};
  groove.triangles = {{0, 3, 1}, {0, 2, 3}, {0, 1, 5}, {0, 5, 4}};
  groove.colors.assign(6, cv::Vec3b(188, 188, 188));  // sends back half of the light (sRGB)
  CaptureOptions options = small_capture();
  options.width = 32, options.height = 24;
  Context context;
  CaptureRig const rig(groove, options, context);
  Vector3d const eye = rig.layout().room_from_light.translation();
  // A point 2 from the edge and in the middle of its height: the other square fills half of what it sees, weighted by
  // the cosine (but for the square's ends: 2 / 400).
  Vector3d const aim = rig.layout().room_from_object[0] * Vector3d(1.4, 0, 1.4);
  std::array<Vector3d, kPacket> directions;
  directions.fill(aim - eye);
  SceneSample const point = rig.scene().look(0, eye, directions, rig.light())[0];
  ASSERT_TRUE(point.is_object);
  EXPECT_NEAR(point.albedo, 0.5, 0.01);
  std::vector<float> direct(48, 0.0f), bounced(48, 0.0f);
  rig.light().add(point.light, point.weight, direct.data());
  add_interreflection(rig.scene(), 0, point, directions[0], rig.light(), 0, 1, CounterRandom(1, 1), bounced.data());
  double sum_direct = 0, sum_bounced = 0;
  for (int k = 0; k < 48; ++k) sum_direct += direct[k], sum_bounced += bounced[k];
  // Both squares are lit alike near the edge: the lamp stands 2 degrees off the middle (3.5 % each way), and what is
  // up to its own distance nearer to the lamp counts as much more; 64 directions share out half a hemisphere to 3 %.
  EXPECT_NEAR(sum_bounced / sum_direct, 0.5 * 0.5, 0.25 * 0.2);
}

TEST(Capture, SameBytesForAnyNumberOfThreads) {
  TriangleMesh const balls = make_two_balls();
  CaptureOptions options;
  options.views = 2;
  options.width = 64;
  options.height = 48;
  options.light.steps = 24;
  options.scene.gloss = 0.1;
  options.scene.interreflection = 1;
  options.faults.flicker = 0.05;
  std::vector<CapturePictures> results;
  for (int const threads : {1, 2}) {
    Context context;
    context.threads = threads;
    CaptureRig const rig(balls, options, context);
    results.push_back(rig.take(1, CaptureSide::right, context));
  }
  EXPECT_TRUE(same_bytes(results[0].color, results[1].color));
  for (std::size_t k = 0; k < 24; ++k) EXPECT_TRUE(same_bytes(results[0].frames[k], results[1].frames[k])) << k;
}

TEST(Capture, FramesGoMissingComeTwiceAndChangePlaces) {
  CaptureFaults faults;
  faults.drop = 2;
  auto const both = CaptureFaults::Side::left;
  EXPECT_EQ(frame_order(faults, 5, both), (std::vector<int>{0, 1, 3, 4, 5}));
  faults = {};
  faults.repeat = 2;
  EXPECT_EQ(frame_order(faults, 5, both), (std::vector<int>{0, 1, 2, 2, 3}));
  faults = {};
  faults.swap = 2;
  EXPECT_EQ(frame_order(faults, 5, both), (std::vector<int>{0, 1, 3, 2, 4}));
  faults.side = CaptureFaults::Side::right;
  EXPECT_EQ(frame_order(faults, 5, both), (std::vector<int>{0, 1, 2, 3, 4}));

  TriangleMesh const square = make_square();
  CaptureOptions options = small_capture();
  options.sensor = {};  // with noise: a frame that comes twice is the same picture
  options.faults.repeat = 24;
  options.faults.rig_moved_deg = 0.3;
  Context context;
  CaptureRig const rig(square, options, context);
  CapturePictures const pictures = rig.take(0, CaptureSide::left, context);
  EXPECT_TRUE(same_bytes(pictures.frames[24], pictures.frames[25]));
  EXPECT_FALSE(same_bytes(pictures.frames[23], pictures.frames[24]));
  Eigen::Matrix3d const turn =
      rig.layout().rig_in_use.right_from_left.linear() * rig.layout().rig.right_from_left.linear().transpose();
  EXPECT_NEAR(Eigen::AngleAxisd(turn).angle() * 180 / std::numbers::pi, 0.3, 1e-9);
}

TEST(Capture, BadOptionsAreNamed) {
  CaptureOptions options;
  options.light.steps = 2;
  EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, "light.steps");
  options = {};
  options.scene.backdrop = "blue";
  EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, "#rrggbb");
  options = {};
  options.faults.drop = 96;
  EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, "no such frame");
}

}  // namespace
}  // namespace scanview
