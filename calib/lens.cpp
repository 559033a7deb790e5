#include "calib/lens.h"

#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "base/error.h"

namespace scanview {
namespace {

/// For every pixel of the ideal picture, where it is in the distorted one.
cv::Mat2f distortion_map(Camera const& camera, Lens const& lens) {
  cv::Mat2f map(camera.height(), camera.width());
  for (int y = 0; y < map.rows; ++y)
    for (int x = 0; x < map.cols; ++x) {
      Eigen::Vector2d const ideal = camera.ray_direction(x, y).head<2>();
      Eigen::Vector2d const seen = lens.distort(ideal);
      map(y, x) = {static_cast<float>(camera.fx() * seen.x() + camera.cx()),
                   static_cast<float>(camera.fy() * seen.y() + camera.cy())};
    }
  return map;
}

}  // namespace

Eigen::Vector2d Lens::distort(Eigen::Vector2d const& p) const {
  double const r2 = p.squaredNorm(), x = p.x(), y = p.y();
  double const radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

Lens Lens::from_json(Json const& json, std::filesystem::path const& path) {
  if (!json.is_array() || json.size() < 4 || json.size() > 5)
    throw Error(ErrorCode::bad_input, path, "'distortion' is not [k1, k2, p1, p2] or [k1, k2, p1, p2, k3]");
  double values[5] = {};
  for (std::size_t i = 0; i < json.size(); ++i) {
    if (!json[i].is_number() || !std::isfinite(json[i].get<double>()))
      throw Error(ErrorCode::bad_input, path, "'distortion' has an entry that is no number");
    values[i] = json[i].get<double>();
  }
  return {values[0], values[1], values[2], values[3], values[4]};
}

cv::Mat undistort_color(cv::Mat const& picture, Camera const& camera, Lens const& lens) {
  if (lens.is_ideal()) return picture;
  cv::Mat result;
  cv::remap(picture, result, distortion_map(camera, lens), cv::noArray(), cv::INTER_LINEAR, cv::BORDER_CONSTANT);
  return result;
}

cv::Mat1f undistort_depth(cv::Mat1f const& depth, Camera const& camera, Lens const& lens) {
  if (lens.is_ideal()) return depth;
  cv::Mat1f result;
  cv::remap(depth, result, distortion_map(camera, lens), cv::noArray(), cv::INTER_NEAREST, cv::BORDER_CONSTANT,
            std::numeric_limits<double>::quiet_NaN());
  return result;
}

}  // namespace scanview
