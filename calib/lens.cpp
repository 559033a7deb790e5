#include "calib/lens.h"

#include <array>
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
  double const radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / (1 + r2 * (k4 + r2 * (k5 + r2 * k6)));
  return {x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y};
}

Eigen::Vector2d Lens::undistort(Eigen::Vector2d const& distorted) const {
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  if (is_ideal()) return distorted;
  Eigen::Vector2d p = distorted;
  for (int step = 0; step < 30; ++step) {
    double const r2 = p.squaredNorm(), x = p.x(), y = p.y();
    double const above = 1 + r2 * (k1 + r2 * (k2 + r2 * k3)), below = 1 + r2 * (k4 + r2 * (k5 + r2 * k6));
    double const radial = above / below;
    // d radial / d r², for the chain rule below.
    double const slope = (k1 + r2 * (2 * k2 + r2 * 3 * k3) - radial * (k4 + r2 * (2 * k5 + r2 * 3 * k6))) / below;
    double const xx = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x;
    double const xy = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
    double const yy = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x;
    double const determinant = xx * yy - xy * xy;
    if (!(determinant > 0) || !(xx > 0)) return {kNone, kNone};  // beyond the fold
    Eigen::Vector2d const error = distort(p) - distorted;
    p -= Eigen::Vector2d(yy * error.x() - xy * error.y(), xx * error.y() - xy * error.x()) / determinant;
    if (error.squaredNorm() < 1e-28) return p;
  }
  if ((distort(p) - distorted).norm() < 1e-9) return p;
  return {kNone, kNone};
}

Lens Lens::from_values(std::vector<double> const& values, std::filesystem::path const& path) {
  if (values.size() != 4 && values.size() != 5 && values.size() != 8)
    throw Error(ErrorCode::bad_input, path,
                "'distortion' is not [k1, k2, p1, p2], [k1, k2, p1, p2, k3] or [k1, k2, p1, p2, k3, k4, k5, k6]");
  std::array<double, 8> all = {};
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!std::isfinite(values[i]))
      throw Error(ErrorCode::bad_input, path, "'distortion' has an entry that is no number");
    all[i] = values[i];
  }
  return {all[0], all[1], all[2], all[3], all[4], all[5], all[6], all[7]};
}

Lens Lens::from_json(Json const& json, std::filesystem::path const& path) {
  if (!json.is_array()) throw Error(ErrorCode::bad_input, path, "'distortion' is no list of numbers");
  std::vector<double> values;
  for (auto const& entry : json)
    values.push_back(entry.is_number() ? entry.get<double>() : std::numeric_limits<double>::quiet_NaN());
  return from_values(values, path);
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
