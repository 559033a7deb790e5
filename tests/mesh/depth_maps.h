#pragma once
#include <cmath>
#include <functional>
#include <limits>

#include "acquire/range_image.h"
#include "base/random.h"

namespace scanview::testing {

/// A range image whose depth at each pixel is a function's value; NaN: none.
inline RangeImage depth_map(Camera const& camera, double sigma, std::function<double(int, int)> const& depth) {
  RangeImage image = empty_range_image(camera);
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      double const z = depth(x, y);
      if (std::isnan(z)) continue;
      image.depth(y, x) = float(z);
      image.sigma(y, x) = float(sigma);
      image.classes(y, x) = std::uint8_t(PixelClass::object);
      image.color(y, x) = cv::Vec3b(uchar(x), uchar(y), uchar(x ^ y));
    }
  return image;
}

inline Camera small_camera(int width = 96, int height = 80) {
  return Camera::perspective(width, height, 100, 100, (width - 1) / 2.0, (height - 1) / 2.0);
}
inline Camera small_orthographic(int width = 96, int height = 80) {
  return Camera::orthographic(width, height, 0.01, 0.01, (width - 1) / 2.0, (height - 1) / 2.0);
}

/// Depth along a pixel's ray of the plane through (0, 0, distance) with the given normal.
inline double plane_depth(Camera const& camera, Eigen::Vector3d const& normal, double distance, double x, double y) {
  Eigen::Vector3d const origin = camera.ray_origin(x, y), direction = camera.ray_direction(x, y);
  double const z = normal.dot(Eigen::Vector3d(0, 0, distance) - origin) / normal.dot(direction);
  return z > 0 ? z : std::numeric_limits<double>::quiet_NaN();
}

/// Of a sphere; NaN beside it.
inline double sphere_depth(Camera const& camera, Eigen::Vector3d const& center, double radius, double x, double y) {
  Eigen::Vector3d const origin = camera.ray_origin(x, y), direction = camera.ray_direction(x, y);
  double const a = direction.squaredNorm(), b = direction.dot(origin - center);
  double const c = (origin - center).squaredNorm() - radius * radius;
  double const root = b * b - a * c;
  return root >= 0 ? (-b - std::sqrt(root)) / a : std::numeric_limits<double>::quiet_NaN();  // direction.z is 1
}

inline double normal_noise(std::uint64_t seed, int x, int y) {
  return CounterRandom(seed, std::uint64_t(y) << 32 | std::uint32_t(x)).normal();
}

}  // namespace scanview::testing
