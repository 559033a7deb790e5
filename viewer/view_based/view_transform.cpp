#include "viewer/view_based/view_transform.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanview {

Eigen::Matrix<double, 3, 4> picture_from_camera(Camera const& camera, int x, int y) {
  Eigen::Matrix<double, 3, 4> m = Eigen::Matrix<double, 3, 4>::Zero();
  int const scale = camera.is_perspective() ? 2 : 3;  // multiplies z, or 1
  m(0, 0) = camera.fx();
  m(0, scale) = camera.cx() + 0.5 - x;
  m(1, 1) = camera.fy();
  m(1, scale) = camera.cy() + 0.5 - y;
  m(2, scale) = 1;
  return m;
}

bool depth_range(Eigen::AlignedBox3d const& bounds, Eigen::Isometry3d const& camera_from_source, bool perspective,
                 DepthRange& range) {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  for (int i = 0; i < 8; ++i) {
    double const z = (camera_from_source * bounds.corner(static_cast<Eigen::AlignedBox3d::CornerType>(i))).z();
    low = std::min(low, z);
    high = std::max(high, z);
  }
  double const margin = 1e-3 * std::max(high - low, 1e-3 * std::max(std::abs(low), std::abs(high))) + 1e-30;
  range.near = low - margin;
  range.far = high + margin;
  if (!perspective) return true;
  constexpr double kNearest = 1e-4;
  range.near = std::max(range.near, kNearest * range.far);
  return high > 0;
}

}  // namespace scanview
