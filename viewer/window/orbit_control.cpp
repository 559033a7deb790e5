#include "viewer/window/orbit_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "viewer/select/view_selection.h"

namespace scanview {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

namespace {
constexpr int kPixels = 480;  // of framing cameras, until a window gives them its size

ScanSet set_about(Vector3d const& center) {
  ScanSet set;
  set.center = center;
  return set;
}
}  // namespace

OrbitControl::OrbitControl(ScanSet const& set, OrbitFrame const& frame)
    : center_(set.center), frame_(frame), start_(framing_camera(set, frame_, frame_.start, kPixels, kPixels)) {
  for (auto const& view : set.views) {
    Camera const& camera = view.image.camera;
    views_.push_back(camera.is_perspective()
                         ? PathCamera{camera, *view.object_from_camera, view.name}
                         : framing_camera(set, frame_, direction_to_eye(camera, *view.object_from_camera, set.center),
                                          kPixels, kPixels));
  }
  reset();
}

OrbitControl::OrbitControl(Vector3d const& center, OrbitFrame const& frame)
    : center_(center), frame_(frame), start_(framing_camera(set_about(center), frame, frame.start, kPixels, kPixels)) {
  reset();
}

void OrbitControl::reset() {
  pivot_ = center_;
  current_ = start_;
}

void OrbitControl::take_eye(PathCamera const& eye, Vector3d const& pivot) {
  pivot_ = pivot;
  current_ = eye;
}

void OrbitControl::rotate(AngleAxisd const& rotation) {
  auto& pose = current_.object_from_camera;
  pose.translation() = pivot_ + rotation * (pose.translation() - pivot_);
  pose.linear() = Eigen::Quaterniond(rotation * pose.linear()).normalized().toRotationMatrix();
}

void OrbitControl::turn(double degrees) { rotate(AngleAxisd(degrees * std::numbers::pi / 180, frame_.up)); }

void OrbitControl::orbit(double right, double down) {
  // The object follows the pointer, so the eye goes the other way.
  rotate(AngleAxisd(-right * std::numbers::pi, frame_.up));
  constexpr double kNearestToPole = 0.02;
  auto const& axes = current_.object_from_camera.linear();
  // Angle between the line of sight and straight up; moving the eye up makes it larger.
  double const angle = std::acos(std::clamp(axes.col(2).dot(frame_.up), -1.0, 1.0));
  double const wanted = std::clamp(angle + down * std::numbers::pi, kNearestToPole, std::numbers::pi - kNearestToPole);
  rotate(AngleAxisd(angle - wanted, axes.col(0)));
}

void OrbitControl::pan(double right, double down) {
  auto& pose = current_.object_from_camera;
  double const depth = std::max((pose.inverse() * pivot_).z(), 1e-6 * frame_.radius);
  Camera const& camera = current_.camera;
  Vector3d const step(right * camera.height() * depth / camera.fx(), down * camera.height() * depth / camera.fy(), 0);
  Vector3d const moved = pose.linear() * step;
  pose.translation() -= moved;
  pivot_ -= moved;
}

void OrbitControl::zoom(double steps) {
  auto& pose = current_.object_from_camera;
  Vector3d const to_eye = pose.translation() - pivot_;
  double const distance = to_eye.norm();
  if (!(distance > 0)) return;
  double const wanted =
      std::clamp(distance * std::pow(0.9, steps), 1e-3 * frame_.radius, 1e3 * (frame_.radius + frame_.distance));
  pose.translation() = pivot_ + to_eye * (wanted / distance);
}

bool OrbitControl::jump(std::size_t view) {
  if (view >= views_.size()) return false;
  pivot_ = center_;
  current_ = views_[view];
  return true;
}

}  // namespace scanview
