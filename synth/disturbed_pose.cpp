#include "synth/disturbed_pose.h"

#include <numbers>

#include "base/error.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

Vector3d random_unit(CounterRandom& random) {
  for (;;) {
    double const x = random.normal(), y = random.normal(), z = random.normal();
    Vector3d const v(x, y, z);
    if (v.norm() > 1e-6) return v.normalized();
  }
}

}  // namespace

void Disturbance::validate() const {
  if (!(turn_deg >= 0 && turn_deg <= 180)) throw Error(ErrorCode::usage, {}, "disturbance.turn_deg: must be 0 to 180");
  if (!(share >= 0 && share <= 10)) throw Error(ErrorCode::usage, {}, "disturbance.share: must be 0 to 10");
}

Eigen::Isometry3d disturbed_pose(Eigen::Isometry3d const& object_from_camera, CenteredModel const& object,
                                 Disturbance const& disturbance, CounterRandom random) {
  Vector3d const axis = random_unit(random), move = random_unit(random);
  Eigen::AngleAxisd const turn(disturbance.turn_deg * std::numbers::pi / 180, axis);
  return Eigen::Translation3d(object.center + disturbance.share * 2 * object.radius * move) * turn *
         Eigen::Translation3d(-object.center) * object_from_camera;
}

}  // namespace scanview
