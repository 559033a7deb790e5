#include "viewer/window/ground_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// The largest of 1, 2, 5, 10, ... that is not greater.
double round_length(double most) {
  double const power = std::pow(10, std::floor(std::log10(most)));
  for (double const digit : {5.0, 2.0})
    if (digit * power <= most) return digit * power;
  return power;
}

}  // namespace

GroundPlan::GroundPlan(Ground const& ground, Eigen::AlignedBox2d const& extent, double least)
    : ground_(ground), middle_(extent.center()) {
  constexpr double kFilled = 0.88;
  scale_ = kFilled *
           std::min(1 / std::max(extent.sizes().x(), least), GroundMap::kHeight / std::max(extent.sizes().y(), least));
}

Vector2d GroundPlan::on_ground(Ground const& ground, Vector3d const& p) {
  return {p.dot(ground.east), -p.dot(ground.north)};
}

Vector2d GroundPlan::place(Vector3d const& p) const {
  return scale_ * (on_ground(ground_, p) - middle_) + Vector2d(0.5, 0.5 * GroundMap::kHeight);
}

void GroundPlan::add_eye_and_bar(GroundMap& map, Vector3d const& eye, double heading_deg, double width_deg) const {
  map.eye = place(eye);
  constexpr double kViewLength = 0.13;
  for (int side = 0; side < 2; ++side) {
    double const angle = (heading_deg + (side - 0.5) * width_deg) * std::numbers::pi / 180;
    map.view[side] = map.eye + kViewLength * Vector2d(std::sin(angle), -std::cos(angle));
  }
  constexpr double kLongestBar = 0.3;
  map.bar = round_length(kLongestBar / scale_);
  map.bar_width = scale_ * map.bar;
}

}  // namespace scanview
