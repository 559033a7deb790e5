#include "viewer/layered/stamp.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "base/srgb.h"

namespace scanview {
namespace {

std::array<double, 256> const& linear_table() {
  static std::array<double, 256> const table = [] {
    std::array<double, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = linear_from_srgb8()[i] * kLinearOne;
    return values;
  }();
  return table;
}

std::uint16_t gained(uchar srgb, double gain) {
  return static_cast<std::uint16_t>(std::clamp(std::round(linear_table()[srgb] * gain), 0.0, double(kLinearOne)));
}

struct Slope {
  double value = 0;
  double bend = std::numeric_limits<double>::infinity();  ///< second difference: of the smoothest stretch the least
  void offer(double slope, double second) {
    // NaN is never less.
    if (std::abs(second) < bend) value = slope, bend = std::abs(second);
  }
};

/// From five keys in a row, the middle one the pixel's.
Slope smoothest(double const (&k)[5]) {
  Slope slope;
  slope.offer((k[3] - k[1]) / 2, k[3] - 2 * k[2] + k[1]);
  slope.offer(k[2] - k[1], k[2] - 2 * k[1] + k[0]);
  slope.offer(k[3] - k[2], k[4] - 2 * k[3] + k[2]);
  if (std::isfinite(slope.bend)) return slope;
  // No three in a row: two are better than none.
  if (std::isfinite(k[1])) slope.value = k[2] - k[1], slope.bend = 0;
  if (std::isfinite(k[3]) && !(std::isfinite(k[1]) && std::abs(slope.value) < std::abs(k[3] - k[2])))
    slope.value = k[3] - k[2], slope.bend = 0;
  return slope;
}

}  // namespace

StampReader::StampReader(View const& view, StampOptions const& options) : view_(view), options_(options) {
  if (!view.object_from_camera) throw std::logic_error("stamps of a view without a pose");
  rotation_ = view.object_from_camera->linear();
  translation_ = view.object_from_camera->translation();
  gain_ = view.gain;
  RangeImage const& image = view.image;
  bool const perspective = image.camera.is_perspective();
  keys_.create(image.depth.size());
  for (int y = 0; y < keys_.rows; ++y)
    for (int x = 0; x < keys_.cols; ++x) {
      float const z = image.depth(y, x);
      bool const valid = image.has_depth(x, y) && std::isfinite(z) && (!perspective || z > 0);
      float const key = perspective ? 1 / z : z;
      keys_(y, x) = valid && std::isfinite(key) ? key : kMissing;
    }
}

double StampReader::key(int x, int y) const {
  return x >= 0 && y >= 0 && x < keys_.cols && y < keys_.rows ? double(keys_(y, x)) : double(kMissing);
}

StampReader::Gradient StampReader::gradient(int x, int y) const {
  double along_u[5], along_v[5];
  for (int i = 0; i < 5; ++i) along_u[i] = key(x + i - 2, y), along_v[i] = key(x, y + i - 2);
  Slope const u = smoothest(along_u), v = smoothest(along_v);
  Gradient gradient{u.value, v.value, std::isfinite(u.bend) && std::isfinite(v.bend)};
  if (gradient.known) refine(x, y, gradient);
  return gradient;
}

/// Least squares over a window that is large enough to tell the slope in spite of the noise: of n points of noise σ in
/// a window of radius r a slope has the error σ / sqrt(Σ x²) = σ / sqrt(n (r² + r) / 3).
void StampReader::refine(int x, int y, Gradient& gradient) const {
  Camera const& camera = view_.image.camera;
  double const z = double(view_.image.depth(y, x)), sigma = double(view_.image.sigma(y, x));
  double const noise = sigma / camera.pixel_size(z);  // as a slope between neighbours
  constexpr double kWanted = 0.1;
  if (!(noise > kWanted)) return;
  int radius = 1;
  auto const error = [&](double r) { return noise / std::sqrt((2 * r + 1) * (2 * r + 1) * (r * r + r) / 3); };
  constexpr int kLargest = 4;
  while (radius < kLargest && error(radius) > kWanted) ++radius;
  double const key_noise = camera.is_perspective() ? sigma / (z * z) : sigma;
  double const here = key(x, y);
  // What one surface may differ by: noise, and a slope of 80 degrees.
  double const step = 5.7 * (camera.is_perspective() ? camera.pixel_size(z) / (z * z) : camera.pixel_size(z));
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  int count = 0;
  for (int dy = -radius; dy <= radius; ++dy)
    for (int dx = -radius; dx <= radius; ++dx) {
      double const difference = key(x + dx, y + dy) - here;
      if (!(std::abs(difference) <= 6 * key_noise + step * std::sqrt(double(dx * dx + dy * dy)))) continue;
      Eigen::Vector3d const row(1, dx, dy);
      normal += row * row.transpose();
      right += difference * row;
      ++count;
    }
  if (count < 6) return;
  double const determinant = normal.determinant();
  if (!(determinant > 1e-3 * double(count))) return;  // collinear
  Eigen::Vector3d const solution = normal.inverse() * right;
  gradient.u = solution[1];
  gradient.v = solution[2];
}

/// Whether a neighbour is not on the tangent plane: the pixel's colour may be a mixture of two surfaces.
bool StampReader::is_rim(int x, int y, Gradient const& gradient) const {
  double const here = key(x, y), z = double(view_.image.depth(y, x)), sigma = double(view_.image.sigma(y, x));
  bool const perspective = view_.image.camera.is_perspective();
  double const noise = perspective ? sigma / (z * z) : sigma;
  double const pixel = view_.image.camera.pixel_size(z) / (perspective ? z * z : 1);
  for (int dy = -1; dy <= 1; ++dy)
    for (int dx = -1; dx <= 1; ++dx) {
      if (x + dx < 0 || y + dy < 0 || x + dx >= keys_.cols || y + dy >= keys_.rows) continue;
      double const slope = dx * gradient.u + dy * gradient.v;
      // Creases bend by about the slope itself; steps are larger.
      double const allowed = 6 * noise + 2 * pixel + std::abs(slope);
      if (!(std::abs(key(x + dx, y + dy) - here - slope) <= allowed)) return true;
    }
  return false;
}

void StampReader::read_row(int y, std::vector<Stamp>& stamps) const {
  RangeImage const& image = view_.image;
  Camera const& camera = image.camera;
  bool const perspective = camera.is_perspective(), measured = options_.normals == StampOptions::Normals::measured;
  for (int x = 0; x < keys_.cols; ++x) {
    if (std::isnan(keys_(y, x))) continue;
    double const z = double(image.depth(y, x));
    Eigen::Vector3d const ray = camera.ray_direction(x, y);
    double const step_u = perspective ? z / camera.fx() : 1 / camera.fx(),
                 step_v = perspective ? z / camera.fy() : 1 / camera.fy();
    // Of plane n · p = 1: 1/z = n · ray, so that the gradient of 1/z is (n_x / fx, n_y / fy).
    Eigen::Vector3d normal = -ray;
    Gradient const g = gradient(x, y);
    Stamp stamp;
    stamp.rim = is_rim(x, y, g);
    if (measured) {
      if (g.known) {
        if (perspective) {
          Eigen::Vector3d n(g.u * camera.fx(), g.v * camera.fy(), 0);
          n.z() = 1 / z - n.x() * ray.x() - n.y() * ray.y();
          normal = n.dot(ray) > 0 ? Eigen::Vector3d(-n) : n;
        } else {
          normal = Eigen::Vector3d(g.u * camera.fx(), g.v * camera.fy(), -1);
        }
      }
    }
    normal.normalize();
    Eigen::Vector3d const toward = -ray.normalized();
    double const cosine = normal.dot(toward);
    if (!(cosine > kGrazing)) {
      Eigen::Vector3d const across = normal - cosine * toward;
      double const length = across.norm();
      normal = length > 0 ? Eigen::Vector3d(kGrazing * toward + std::sqrt(1 - kGrazing * kGrazing) / length * across)
                          : toward;
    }
    // A step to the next pixel's ray, and along the ray back into the plane.
    double const slant = normal.dot(ray);
    Eigen::Vector3d const along_u = step_u * (Eigen::Vector3d::UnitX() - normal.x() / slant * ray),
                          along_v = step_v * (Eigen::Vector3d::UnitY() - normal.y() / slant * ray);
    stamp.center = rotation_ * camera.unproject(x, y, z) + translation_;
    stamp.normal = (rotation_ * normal).cast<float>();
    stamp.along_u = (rotation_ * along_u).cast<float>();
    stamp.along_v = (rotation_ * along_v).cast<float>();
    stamp.size = static_cast<float>(std::sqrt(step_u * step_v) / std::max(cosine, kGrazing));
    cv::Vec3b const& color = image.color(y, x);
    stamp.red = gained(color[2], gain_[0]);
    stamp.green = gained(color[1], gain_[1]);
    stamp.blue = gained(color[0], gain_[2]);
    if (!stamp.center.allFinite() || !stamp.normal.allFinite() || !stamp.along_u.allFinite() ||
        !stamp.along_v.allFinite() || !(stamp.size > 0) || !std::isfinite(stamp.size))
      continue;
    stamps.push_back(stamp);
  }
}

}  // namespace scanview
