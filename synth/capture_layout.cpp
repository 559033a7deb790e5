#include "synth/capture_layout.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace scanview {
namespace {

using Eigen::AngleAxisd;
using Eigen::Isometry3d;
using Eigen::Vector3d;

constexpr double kFill = 0.76;         // of the picture's width or height, about its centre
constexpr double kSweepMargin = 0.08;  // of the object's angle, on either side
constexpr double kGap = 2e-3;          // between turntable and object, radii: they never intersect
constexpr double kLeftElevation = 15.0, kRightElevation = 14.2, kLampAzimuth = 2.0, kLampElevation = 24.0;
constexpr double kTiltHigh = 60, kTiltLow = -70;
constexpr int kHullDirections = 400;

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// The points furthest out in many directions: they decide what a picture must hold.
std::vector<Vector3d> outermost(CenteredModel const& model) {
  std::vector<Vector3d> points(kHullDirections);
  for (int i = 0; i < kHullDirections; ++i) {
    double const y = 1 - (2.0 * i + 1) / kHullDirections, r = std::sqrt(1 - y * y);
    double const a = std::numbers::pi * (3 - std::sqrt(5.0)) * i;
    Eigen::Vector3f const direction = Vector3d(r * std::cos(a), y, r * std::sin(a)).cast<float>();
    float best = -std::numeric_limits<float>::infinity();
    for (auto const& vertex : model.vertices)
      if (float const along = direction.dot(vertex); along > best) {
        best = along;
        points[i] = vertex.cast<double>();
      }
  }
  return points;
}

/// Turned about its centre; then laid onto the turntable.
Isometry3d laid_down(CenteredModel const& model, Eigen::Matrix3d const& turn) {
  Eigen::Matrix3f const turn_f = turn.cast<float>();
  float lowest = std::numeric_limits<float>::infinity();
  for (auto const& vertex : model.vertices) lowest = std::min(lowest, turn_f.row(1).dot(vertex));
  Isometry3d room_from_object = Isometry3d::Identity();
  room_from_object.linear() = turn;
  room_from_object.translation() = Vector3d(0, kGap * model.radius - lowest, 0) - turn * model.center;
  return room_from_object;
}

std::vector<Isometry3d> object_poses(CenteredModel const& model, int views) {
  int const tilted = views < 6 ? 0 : views / 3, high = tilted - tilted / 2, around = views - tilted;
  std::vector<Isometry3d> poses;
  for (int v = 0; v < views; ++v) {
    bool const is_high = v >= around && v < around + high;
    int const first = v < around ? 0 : is_high ? around : around + high;
    int const count = v < around ? around : is_high ? high : tilted - high;
    // The tilted ones start halfway between two sides, so that they differ from those around.
    double const azimuth = 2 * std::numbers::pi * (v - first + (v < around ? 0.0 : 0.5)) / count;
    double const tilt = v < around ? 0 : is_high ? kTiltHigh : kTiltLow;
    poses.push_back(laid_down(
        model,
        (AngleAxisd(radians(tilt), Vector3d::UnitX()) * AngleAxisd(-azimuth, Vector3d::UnitY())).toRotationMatrix()));
  }
  return poses;
}

/// Seen from the target; azimuth to the right.
Vector3d direction(double azimuth_deg, double elevation_deg) {
  double const a = radians(azimuth_deg), e = radians(elevation_deg);
  return {std::sin(a) * std::cos(e), std::sin(e), std::cos(a) * std::cos(e)};
}

Isometry3d rolled(Isometry3d const& pose, double degrees) {
  return pose * AngleAxisd(radians(degrees), Vector3d::UnitZ());
}

void place_cameras(CaptureLayout& layout, double distance, double radius, double baseline_deg) {
  Vector3d const& at = layout.target;
  layout.room_from_left = rolled(
      look_at(at + distance * direction(-0.5 * baseline_deg, kLeftElevation), at + radius * Vector3d(0.01, 0.02, 0)),
      -0.4);
  Isometry3d const room_from_right =
      rolled(look_at(at + 1.01 * distance * direction(0.5 * baseline_deg, kRightElevation),
                     at + radius * Vector3d(-0.02, -0.01, 0)),
             0.6);
  layout.rig.right_from_left = room_from_right.inverse() * layout.room_from_left;
  layout.room_from_light = look_at(at + 1.08 * distance * direction(kLampAzimuth, kLampElevation), at);
}

/// Where a set of points lies in both pictures, as shares of half the picture from its centre.
struct Extent {
  double most = 0;                   ///< of all four sides: 1 where a point touches the border
  double above = 1e9, below = -1e9;  ///< the highest and lowest point
};

Extent extent(CaptureLayout const& layout, std::vector<Vector3d> const& room_points) {
  Extent result;
  Isometry3d const left_from_room = layout.room_from_left.inverse();
  Isometry3d const right_from_room = layout.rig.right_from_left * left_from_room;
  for (auto const& p : room_points)
    for (auto const& [camera, pose] :
         {std::pair{&layout.rig.left.camera, &left_from_room}, std::pair{&layout.rig.right.camera, &right_from_room}}) {
      Vector3d const q = *pose * p;
      if (q.z() <= 0) {
        result.most = std::numeric_limits<double>::infinity();
        return result;
      }
      Eigen::Vector2d const pixel = camera->project(q);
      double const across = (pixel.x() - 0.5 * (camera->width() - 1)) / (0.5 * camera->width());
      double const down = (pixel.y() - 0.5 * (camera->height() - 1)) / (0.5 * camera->height());
      result.most = std::max({result.most, std::abs(across), std::abs(down)});
      result.above = std::min(result.above, down), result.below = std::max(result.below, down);
    }
  return result;
}

StereoRig cameras(CaptureOptions const& options) {
  double const w = options.width, h = options.height, f = 1.3 * std::max(w, h);
  StereoRig rig;
  rig.left.camera = Camera::perspective(options.width, options.height, f, 1.0015 * f, 0.5 * (w - 1) + 0.012 * w,
                                        0.5 * (h - 1) - 0.009 * h);
  rig.left.lens = {-0.16, 0.09, 0.0006, -0.0004, 0};
  rig.right.camera = Camera::perspective(options.width, options.height, 1.006 * f, 1.0068 * f,
                                         0.5 * (w - 1) - 0.008 * w, 0.5 * (h - 1) + 0.011 * h);
  rig.right.lens = {-0.14, 0.07, -0.0005, 0.0007, 0};
  return rig;
}

}  // namespace

Camera ideal_left_camera(StereoRig const& rig) { return rig.left.camera; }

CaptureLayout make_layout(CenteredModel const& model, CaptureOptions const& options) {
  CaptureLayout layout;
  layout.room_from_object = object_poses(model, options.views);
  std::vector<Vector3d> points;
  Eigen::AlignedBox3d box;
  auto const hull = outermost(model);
  for (auto const& pose : layout.room_from_object)
    for (auto const& p : hull) {
      points.push_back(pose * (model.center + p));
      box.extend(points.back());
    }
  layout.target = Vector3d(0, box.center().y(), 0);
  layout.rig = cameras(options);
  // As near as the picture allows; then look higher or lower, so that it allows more.
  for (int round = 0; round < 4; ++round) {
    double near = 1.5 * model.radius, far = 200 * model.radius;
    for (int step = 0; step < 60; ++step) {
      double const middle = 0.5 * (near + far);
      place_cameras(layout, middle, model.radius, options.baseline_deg);
      (extent(layout, points).most > kFill ? near : far) = middle;
    }
    place_cameras(layout, far, model.radius, options.baseline_deg);
    Extent const seen = extent(layout, points);
    if (round < 3)
      layout.target.y() -= 0.5 * (seen.above + seen.below) * 0.5 * options.height / layout.rig.left.camera.fy() * far;
  }

  layout.rig_in_use = layout.rig;
  layout.rig_in_use.right_from_left =
      AngleAxisd(radians(options.faults.rig_moved_deg), Vector3d(0.5, 0.8, 0.2).normalized()) *
      layout.rig.right_from_left;

  Isometry3d const light_from_room = layout.room_from_light.inverse();
  double low = std::numbers::pi, high = -std::numbers::pi;
  for (auto const& p : points) {
    Vector3d const q = light_from_room * p;
    double const angle = std::atan2(q.x(), q.z());
    low = std::min(low, angle), high = std::max(high, angle);
    layout.tallest = std::max(layout.tallest, std::abs(q.y() / q.z()));
  }
  layout.sweep_low = low - kSweepMargin * (high - low);
  layout.sweep_high = high + kSweepMargin * (high - low);

  double reach = 0;
  for (auto const& p : points) reach = std::max(reach, std::hypot(p.x(), p.z()));
  layout.disc_radius = 1.12 * reach;
  layout.backdrop_z = -1.8 * reach;
  return layout;
}

}  // namespace scanview
