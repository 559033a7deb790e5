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

PicturePlace picture_place(Camera const& source, cv::Rect const& area, Eigen::Isometry3d const& source_from_camera,
                           Camera const& camera) {
  Eigen::Matrix<double, 3, 4> const texel = picture_from_camera(source, area.x, area.y) * source_from_camera.matrix();
  // x and y of the point, in units of z (perspective) or as they are (orthographic).
  Eigen::Matrix<double, 2, 3> xy;
  xy << 1 / camera.fx(), 0, -camera.cx() / camera.fx(), 0, 1 / camera.fy(), -camera.cy() / camera.fy();
  Eigen::Matrix3d along = Eigen::Matrix3d::Zero(), at = Eigen::Matrix3d::Zero();
  (camera.is_perspective() ? along : at) = texel.leftCols<2>() * xy;
  along.col(2) += texel.col(2);
  at.col(2) += texel.col(3);
  return {along.cast<float>(), at.cast<float>()};
}

ScreenTransform screen_transform(Camera const& camera, Eigen::Isometry3d const& camera_from_source,
                                 DepthRange const& range) {
  auto picture = picture_from_camera(camera);
  picture.topRows<2>() -= 0.5 * picture.row(2).replicate<2, 1>();  // from corners to centres
  Eigen::Matrix<double, 3, 4> const rows = picture * camera_from_source.matrix();
  ScreenTransform transform;
  for (int c = 0; c < 4; ++c) {
    for (int r = 0; r < 3; ++r) transform.rows[r][c] = rows(r, c);  // u, v, w
    for (int r = 0; r < 3; ++r) transform.rows[ScreenTransform::x_camera + r][c] = camera_from_source.matrix()(r, c);
  }
  transform.perspective = camera.is_perspective();
  transform.near = range.near;
  return transform;
}

}  // namespace scanview
