#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "synth/ray_scene.h"

namespace scanview {

/// How much of an even sky the turntable (the plane y = 0 of the room) still sees around an object that stands on it:
/// 1 far away, towards 0 beneath it. Computed on a grid over the square of side 2 `radius` about the origin.
class ContactShade {
 public:
  /// 64 rays a grid point, 9216 grid points.
  ContactShade(RayScene const& object, Eigen::Isometry3d const& model_from_room, double radius);
  /// Bilinear; 1 outside the square.
  float at(double x, double z) const;

 private:
  static constexpr int kSide = 96;
  double radius_;
  std::vector<float> open_;  // kSide rows along z of kSide along x
};

}  // namespace scanview
