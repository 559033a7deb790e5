#include "viewer/visibility/sample_camera.h"

#include <algorithm>
#include <cmath>

#include "viewer/select/camera_path.h"

namespace scanview {

SampleCamera ball_camera(Eigen::Vector3d const& center, double radius, Eigen::Vector3d const& direction,
                         double distance, int resolution) {
  Eigen::Vector3d const up =
      std::abs(direction.normalized().z()) < 0.9 ? Eigen::Vector3d::UnitZ() : Eigen::Vector3d::UnitX();
  double const middle = (resolution - 1) / 2.0, half = std::max(resolution / 2.0 - 1, 0.25);
  bool const far = !std::isfinite(distance);
  Eigen::Vector3d const eye = center + direction.normalized() * (radius * (far ? 2 : distance));
  double const focal = half * std::sqrt(distance * distance - 1);  // tan(asin(1 / distance))
  Camera const camera = far ? Camera::orthographic(resolution, resolution, radius / half, radius / half, middle, middle)
                            : Camera::perspective(resolution, resolution, focal, focal, middle, middle);
  return {camera, look_at(eye, center, up), 0};
}

}  // namespace scanview
