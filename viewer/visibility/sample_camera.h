#pragma once
#include <Eigen/Geometry>

#include "calib/camera.h"

namespace scanview {

/// A camera that samples what can be seen, and the eyes it stands for.
struct SampleCamera {
  Camera camera;
  Eigen::Isometry3d object_from_camera = Eigen::Isometry3d::Identity();
  /// How far from the camera such an eye may be: across the line of sight, in the model's unit; of an orthographic
  /// camera, the angle in radians. 0: what the picture shows, no more.
  double movement = 0;
  /// And by how much, in radians, its line of sight to a point of the model may differ: what turns its back to the
  /// camera by less may show its front.
  double turn = 0;
};

/// A square picture of a ball, which it just holds: from `distance` radii away from its centre (more than 1), or
/// orthographic (infinite).
SampleCamera ball_camera(Eigen::Vector3d const& center, double radius, Eigen::Vector3d const& direction,
                         double distance, int resolution);

}  // namespace scanview
