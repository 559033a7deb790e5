#include "acquire/range_image.h"

#include <Eigen/Eigenvalues>
#include <cmath>
#include <stdexcept>

namespace scanview {

void RangeImage::remove(int x, int y, PixelClass why) {
  depth(y, x) = kMissing;
  sigma(y, x) = kMissing;
  classes(y, x) = static_cast<std::uint8_t>(why);
}

std::size_t RangeImage::count_depths() const {
  std::size_t count = 0;
  for (int y = 0; y < classes.rows; ++y)
    for (int x = 0; x < classes.cols; ++x) count += has_depth(x, y);
  return count;
}

void RangeImage::check() const {
  cv::Size const size(camera.width(), camera.height());
  if (depth.size() != size || sigma.size() != size || classes.size() != size ||
      (!color.empty() && color.size() != size))
    throw std::logic_error("a range image whose parts differ in size");
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      float const z = depth(y, x), s = sigma(y, x);
      bool const good = std::isfinite(z) && std::isfinite(s) && s > 0 && (z > 0 || !camera.is_perspective());
      if (has_depth(x, y) ? !good : !(std::isnan(z) && std::isnan(s)))
        throw std::logic_error("a range image whose depths do not agree with its classes");
    }
}

RangeImage empty_range_image(Camera const& camera) {
  RangeImage image;
  image.camera = camera;
  image.depth = cv::Mat1f(camera.height(), camera.width(), kMissing);
  image.sigma = image.depth.clone();
  image.color = cv::Mat3b(camera.height(), camera.width(), cv::Vec3b(0, 0, 0));
  image.classes = cv::Mat1b(camera.height(), camera.width(), static_cast<std::uint8_t>(PixelClass::no_depth));
  return image;
}

cv::Mat3f estimate_normals(RangeImage const& image, int radius, double step_sigmas) {
  cv::Mat3f normals(image.depth.rows, image.depth.cols, cv::Vec3f::all(kMissing));
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x) {
      if (!image.has_depth(x, y)) continue;
      // A slope of up to 80 degrees (tan = 5.7) is still one surface; so is a jump that noise explains.
      double const pixel = image.camera.pixel_size(image.depth(y, x));
      Eigen::Vector3d const center = image.point(x, y);
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();
      Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
      int count = 0;
      for (int dy = -radius; dy <= radius; ++dy)
        for (int dx = -radius; dx <= radius; ++dx) {
          int const u = x + dx, v = y + dy;
          if (u < 0 || v < 0 || u >= image.depth.cols || v >= image.depth.rows || !image.has_depth(u, v)) continue;
          double const distance = std::sqrt(static_cast<double>(dx * dx + dy * dy));
          double const allowed =
              step_sigmas * std::hypot(image.sigma(y, x), image.sigma(v, u)) + 5.7 * pixel * distance;
          if (std::abs(image.depth(v, u) - image.depth(y, x)) > allowed) continue;
          Eigen::Vector3d const p = image.point(u, v) - center;  // relative: far from the origin digits would be lost
          mean += p;
          moments += p * p.transpose();
          ++count;
        }
      if (count < 3) continue;
      mean /= count;
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> const eigen(moments / count - mean * mean.transpose());
      if (!(eigen.eigenvalues()(1) > 1e-6 * eigen.eigenvalues()(2))) continue;  // collinear
      Eigen::Vector3d normal = eigen.eigenvectors().col(0);
      if (normal.dot(image.camera.ray_direction(x, y)) > 0) normal = -normal;
      normals(y, x) =
          cv::Vec3f(static_cast<float>(normal.x()), static_cast<float>(normal.y()), static_cast<float>(normal.z()));
    }
  return normals;
}

}  // namespace scanview
