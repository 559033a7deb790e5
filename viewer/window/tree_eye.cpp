#include "viewer/window/tree_eye.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

Vector3d near_axis(Vector3d const& up) {
  Eigen::Index axis = 0;
  double const most = up.cwiseAbs().maxCoeff(&axis);
  if (most < std::cos(5 * kDegree)) return up;
  return std::copysign(1.0, up[axis]) * Vector3d::Unit(axis);
}

OrbitControl orbit_about(LdiTree const& tree, TreeEye::Mode start) {
  ScanSet set;
  set.unit = tree.unit;
  set.center = tree.center;
  set.views = tree.views;
  OrbitFrame frame{Vector3d::UnitY(), Vector3d::UnitZ(), 4 * tree.radius, tree.radius};
  if (!tree.views.empty()) frame = orbit_frame(set, tree.radius);
  // Eyes within a scene may lie on any circle: it has an up of its own.
  if (start == TreeEye::Mode::walk) frame.up = up_of_views(tree.views);
  return {set, frame};
}

}  // namespace

Vector3d up_of_views(std::vector<View> const& views) {
  if (views.empty()) return Vector3d::UnitY();
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Vector3d mean = Vector3d::Zero();
  for (View const& view : views) {
    Eigen::Matrix3d const& axes = view.object_from_camera->linear();
    spread += axes.col(0) * axes.col(0).transpose();
    mean -= axes.col(1);
  }
  if (mean.norm() < 0.1 * static_cast<double>(views.size())) mean = -views.front().object_from_camera->linear().col(1);
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> const axes(spread / static_cast<double>(views.size()));
  // Horizontal axes that fan out by some ten degrees lie in a plane that is known to a degree or two.
  constexpr double kFan = 0.03;
  if (axes.eigenvalues()[1] < kFan || axes.eigenvalues()[0] > 0.3 * axes.eigenvalues()[1])
    return near_axis(mean.normalized());
  Vector3d const across = axes.eigenvectors().col(0);
  return near_axis(across.dot(mean) < 0 ? Vector3d(-across) : across);
}

bool look_inwards(std::vector<View> const& views, Vector3d const& center, double radius) {
  constexpr double kAside = 40 * kDegree;
  auto const is_inward = [&](View const& view) {
    Vector3d const way = center - view.eye();
    bool const outside = !view.image.camera.is_perspective() || way.norm() > radius;
    return outside && view.object_from_camera->linear().col(2).dot(way.normalized()) > std::cos(kAside);
  };
  auto const inward = std::count_if(views.begin(), views.end(), is_inward);
  return 2 * static_cast<std::size_t>(inward) >= views.size();
}

TreeEye::TreeEye(LdiTree const& tree)
    : views_(tree.views),
      center_(tree.center),
      radius_(tree.radius),
      start_(look_inwards(tree.views, tree.center, tree.radius) ? Mode::orbit : Mode::walk),
      mode_(start_),
      orbit_(orbit_about(tree, start_)),
      walker_(up_of_views(tree.views), std::nullopt) {
  reset();
}

PathCamera TreeEye::current() const {
  if (mode_ == Mode::orbit) return orbit_.current();
  return {walker_.camera(), walker_.scene_from_camera(), ""};
}

void TreeEye::look_along(Eigen::Isometry3d const& object_from_camera) {
  Vector3d const ahead = object_from_camera.linear().col(2);
  Ground const& ground = walker_.ground();
  walker_.stand_at(object_from_camera.translation());
  walker_.face(std::atan2(ahead.dot(ground.east), ahead.dot(ground.north)) / kDegree,
               std::asin(std::clamp(ahead.dot(ground.up), -1.0, 1.0)) / kDegree);
}

void TreeEye::reset() {
  mode_ = start_;
  orbit_.reset();
  view_.reset();
  if (mode_ == Mode::walk) jump(0);
}

void TreeEye::change_mode(Vector3d const& pivot) {
  if (mode_ == Mode::orbit) {
    look_along(orbit_.current().object_from_camera);
    mode_ = Mode::walk;
  } else {
    orbit_.take_eye(current(), pivot);
    mode_ = Mode::orbit;
  }
}

bool TreeEye::jump(std::size_t view) {
  if (view >= views_.size()) return false;
  view_ = view;
  if (mode_ == Mode::orbit) return orbit_.jump(view);
  look_along(*views_[view].object_from_camera);
  return true;
}

std::optional<std::size_t> TreeEye::view_after(int steps) const {
  if (views_.empty()) return std::nullopt;
  int const count = static_cast<int>(views_.size());
  int const from = view_ ? static_cast<int>(*view_) : steps > 0 ? -1 : 0;
  return static_cast<std::size_t>(((from + steps) % count + count) % count);
}

std::optional<std::size_t> TreeEye::middle_view() const {
  if (views_.empty()) return std::nullopt;
  auto const distance = [&](View const& view) { return (view.eye() - center_).squaredNorm(); };
  auto const nearest = std::min_element(views_.begin(), views_.end(),
                                        [&](View const& a, View const& b) { return distance(a) < distance(b); });
  return static_cast<std::size_t>(nearest - views_.begin());
}

void TreeEye::turn(double degrees) {
  if (mode_ == Mode::orbit) {
    orbit_.turn(degrees);
  } else {
    walker_.walk({0, 0, 0, degrees});
  }
}

void TreeEye::walk(WalkStep step) {
  double const turn_deg = step.turn_deg;
  step = step * radius_;
  step.turn_deg = turn_deg;
  walker_.walk(step);
}

}  // namespace scanview
