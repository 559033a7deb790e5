#include "viewer/window/walk_control.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = std::numbers::pi / 180;

double whole_turn(double degrees) {
  double const rest = std::fmod(degrees, 360);
  return rest < 0 ? rest + 360 : rest;
}

Vector3d most_level_axis(Vector3d const& up) {
  Vector3d axis = Vector3d::UnitX();
  for (int i = 1; i < 3; ++i)
    if (std::abs(up[i]) < std::abs(axis.dot(up)) - 1e-9) axis = Vector3d::Unit(i);
  return axis;
}

}  // namespace

Ground::Ground(Vector3d const& any_up) : up(any_up.normalized()) {
  Vector3d const axis = most_level_axis(up);
  east = (axis - axis.dot(up) * up).normalized();
  north = up.cross(east);
}

WalkStep& WalkStep::operator+=(WalkStep const& other) {
  forward += other.forward;
  right += other.right;
  up += other.up;
  turn_deg += other.turn_deg;
  return *this;
}

WalkStep WalkStep::operator*(double times) const {
  return {times * forward, times * right, times * up, times * turn_deg};
}

WalkControl::WalkControl(Vector3d const& up, std::optional<Eigen::AlignedBox3d> const& box) : ground_(up), box_(box) {}

Eigen::Isometry3d WalkControl::scene_from_camera() const {
  double const heading = kDegree * heading_deg_, pitch = kDegree * pitch_deg_;
  Vector3d const level = std::cos(heading) * ground_.north + std::sin(heading) * ground_.east;
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = std::cos(heading) * ground_.east - std::sin(heading) * ground_.north;
  pose.linear().col(1) = std::sin(pitch) * level - std::cos(pitch) * ground_.up;
  pose.linear().col(2) = std::cos(pitch) * level + std::sin(pitch) * ground_.up;
  pose.translation() = eye_;
  return pose;
}

Camera WalkControl::camera() const {
  constexpr int kWidth = 1024, kHeight = 768;
  double const focal = 0.5 * kHeight / std::tan(30 * kDegree);
  return Camera::perspective(kWidth, kHeight, focal, focal, 0.5 * (kWidth - 1), 0.5 * (kHeight - 1));
}

void WalkControl::face(double heading_deg, double pitch_deg) {
  heading_deg_ = whole_turn(heading_deg);
  pitch_deg_ = std::clamp(pitch_deg, -kSteepestDeg, kSteepestDeg);
}

void WalkControl::face(Vector3d const& p_scene) {
  Vector3d const way = p_scene - eye_;
  double const east = way.dot(ground_.east), north = way.dot(ground_.north);
  constexpr double kRightAbove = 1e-6;
  if (std::hypot(east, north) > kRightAbove * way.norm()) face(std::atan2(east, north) / kDegree, 0);
}

WalkControl::Walked WalkControl::walk(WalkStep const& step) {
  // Along an arc, the chord is shorter than the way by sin(x) / x and points to the heading halfway.
  double const half = 0.5 * kDegree * step.turn_deg;
  double const chord = half == 0 ? 1 : std::sin(half) / half;
  double const middle = kDegree * heading_deg_ + half;
  Vector3d const forward = std::cos(middle) * ground_.north + std::sin(middle) * ground_.east;
  Vector3d const right = std::cos(middle) * ground_.east - std::sin(middle) * ground_.north;
  Vector3d const wanted = eye_ + chord * (step.forward * forward + step.right * right) + step.up * ground_.up;
  face(heading_deg_ + step.turn_deg, pitch_deg_);
  if (is_free || !box_) {
    eye_ = wanted;
    return Walked::freely;
  }
  Eigen::AlignedBox3d const reach = box_->merged(Eigen::AlignedBox3d(eye_));
  eye_ = wanted.cwiseMax(reach.min()).cwiseMin(reach.max());
  double const off = (eye_ - wanted).norm();
  return off > 0 ? Walked::held_back : Walked::freely;
}

void WalkControl::drag(Camera const& camera, Vector2d const& from, Vector2d const& to) {
  Vector3d const seen = scene_from_camera().linear() * camera.ray_direction(from.x(), from.y()).normalized();
  Vector3d const ray = camera.ray_direction(to.x(), to.y()).normalized();
  // The pitch at which `ray` rises as far as `seen` does, then the heading at which it points there.
  double const rise = seen.dot(ground_.up), most = std::hypot(ray.y(), ray.z());
  double const pitch = std::atan2(ray.y(), ray.z()) + std::asin(std::clamp(rise / most, -1.0, 1.0));
  face(heading_deg_, pitch / kDegree);
  double const held = kDegree * pitch_deg_;
  double const ahead = std::cos(held) * ray.z() + std::sin(held) * ray.y();
  double const heading = std::atan2(seen.dot(ground_.east), seen.dot(ground_.north)) - std::atan2(ray.x(), ahead);
  face(heading / kDegree, pitch_deg_);
}

}  // namespace scanview
