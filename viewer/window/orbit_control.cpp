#include "viewer/window/orbit_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "viewer/select/view_selection.h"

namespace scanview {

using Eigen::AngleAxisd;
using Eigen::Vector3d;

OrbitControl::OrbitControl(ScanSet const& set) : set_(set), frame_(orbit_frame(set)) { reset(); }

void OrbitControl::reset() {
  pivot_ = set_.center;
  current_ = framing_camera(set_, frame_, frame_.start, 480, 480);
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

bool OrbitControl::jump(std::size_t index) {
  if (index >= set_.views.size()) return false;
  View const& view = set_.views[index];
  pivot_ = set_.center;
  if (view.image.camera.is_perspective()) {
    current_ = {view.image.camera, *view.object_from_camera, view.name};
  } else {
    current_ = framing_camera(set_, frame_, direction_to_eye(view.image.camera, *view.object_from_camera, set_.center),
                              480, 480);
  }
  return true;
}

}  // namespace scanview
