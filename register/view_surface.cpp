#include "register/view_surface.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <optional>

#include "acquire/import_build.h"

namespace scanview {
namespace {

constexpr double kMinCosine = 0.15;         // beyond 81 degrees a pixel says little about where the surface is
constexpr double kMaxSlope = 4.0;           // depth a pixel's width, of one surface
constexpr double kTargetSlopeNoise = 0.04;  // radians: the window grows until normals are about this good
constexpr double kCreaseMisfit = 0.15;      // of a pixel's width: what a plane may be off where the surface is smooth
constexpr int kMinLevelSide = 40;
constexpr float kToneBlur = 6.0f;  // pixels of the level

float nan_f() { return kMissing; }

// Depth as it is linear on planes: 1/z for perspective, z for orthographic cameras.
double linear_depth(Camera const& camera, double z) { return camera.is_perspective() ? 1.0 / z : z; }

double median_of(std::vector<double>& values) {
  if (values.empty()) return 0;
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

struct Level {
  Camera camera;
  cv::Mat1f depth, sigma;
  cv::Mat1f brightness;  // logarithm; empty without colour
};

Level finest_level(RangeImage const& image) {
  Level level{image.camera, image.depth.clone(), image.sigma.clone(), {}};
  for (int y = 0; y < level.depth.rows; ++y)
    for (int x = 0; x < level.depth.cols; ++x)
      if (!image.has_depth(x, y)) level.depth(y, x) = level.sigma(y, x) = nan_f();
  if (image.color.empty()) return level;
  cv::Mat gray;
  cv::cvtColor(image.color, gray, cv::COLOR_BGR2GRAY);
  level.brightness.create(gray.size());
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x)
      level.brightness(y, x) = std::log((static_cast<float>(gray.at<uchar>(y, x)) + 12.0f) / 255.0f);
  return level;
}

// Half the size. A block's depth is the mean over its nearest surface.
Level coarser(Level const& fine) {
  int const width = fine.depth.cols / 2, height = fine.depth.rows / 2;
  Level level;
  level.camera = fine.camera.cropped(0, 0, 2 * width, 2 * height).resized(width, height);
  level.depth = cv::Mat1f(height, width, nan_f());
  level.sigma = cv::Mat1f(height, width, nan_f());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      float nearest = nan_f();
      for (int k = 0; k < 4; ++k) {
        float const z = fine.depth(2 * y + k / 2, 2 * x + k % 2);
        if (std::isfinite(z) && !(nearest <= z)) nearest = z;
      }
      if (!std::isfinite(nearest)) continue;
      double const step = kMaxSlope * 1.5 * fine.camera.pixel_size(nearest);
      double sum = 0, sum_sigma = 0;
      int count = 0;
      for (int k = 0; k < 4; ++k) {
        float const z = fine.depth(2 * y + k / 2, 2 * x + k % 2);
        float const sigma = fine.sigma(2 * y + k / 2, 2 * x + k % 2);
        if (!std::isfinite(z) || z - nearest > step + 6 * sigma) continue;
        sum += linear_depth(fine.camera, z);
        sum_sigma += sigma;
        ++count;
      }
      level.depth(y, x) = static_cast<float>(linear_depth(fine.camera, sum / count));
      level.sigma(y, x) = static_cast<float>(sum_sigma / count / std::sqrt(count));
    }
  if (!fine.brightness.empty())
    cv::resize(fine.brightness(cv::Rect(0, 0, 2 * width, 2 * height)), level.brightness, {width, height}, 0, 0,
               cv::INTER_AREA);
  return level;
}

// Window half width for which noise turns a fitted plane by no more than kTargetSlopeNoise.
int window_radius(Level const& level) {
  std::vector<double> noise;
  for (int y = 0; y < level.depth.rows; y += 2)
    for (int x = 0; x < level.depth.cols; x += 2)
      if (std::isfinite(level.depth(y, x)))
        noise.push_back(level.sigma(y, x) / level.camera.pixel_size(level.depth(y, x)));
  double const pixels = median_of(noise);
  int radius = 2;
  // Standard deviation of the slope of a line through (2r+1)^2 depths of unit noise.
  auto const slope_noise = [](int r) { return std::sqrt(3.0 / (r * (r + 1.0))) / (2.0 * r + 1.0); };
  while (radius < 6 && pixels * slope_noise(radius) > kTargetSlopeNoise) ++radius;
  return radius;
}

// The depth around which a pixel's window gathers its surface: its own, or of a hole the mean of what surrounds it.
std::optional<double> window_center(Level const& level, int x, int y) {
  float const own = level.depth(y, x);
  if (std::isfinite(own)) return own;
  double sum = 0, low = std::numeric_limits<double>::infinity(), high = -low;
  int count = 0;
  for (int v = std::max(0, y - 1); v <= std::min(level.depth.rows - 1, y + 1); ++v)
    for (int u = std::max(0, x - 1); u <= std::min(level.depth.cols - 1, x + 1); ++u) {
      float const z = level.depth(v, u);
      if (!std::isfinite(z)) continue;
      sum += z;
      low = std::min<double>(low, z);
      high = std::max<double>(high, z);
      ++count;
    }
  if (count < 3) return std::nullopt;
  double const mean = sum / count;
  if (high - low > 2 * kMaxSlope * level.camera.pixel_size(mean)) return std::nullopt;
  return mean;
}

// `squares`: sum of the squared linear depths of the window less their plane's.
bool is_crease(Level const& level, double squares, int count, double z, double sigma) {
  double const misfit = std::sqrt(std::max(0.0, squares) / count) * (level.camera.is_perspective() ? z * z : 1.0);
  return misfit > std::hypot(2 * sigma, kCreaseMisfit * level.camera.pixel_size(z));
}

void fit_pixel(Level const& level, int radius, int x, int y, ViewSurface& surface) {
  auto const center = window_center(level, x, y);
  if (!center) return;
  Camera const& camera = level.camera;
  double const pixel = camera.pixel_size(*center);
  Eigen::Matrix3d normal_matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double sigma_sum = 0, squares = 0;
  int count = 0;
  double const scale = linear_depth(camera, *center);
  for (int v = std::max(0, y - radius); v <= std::min(level.depth.rows - 1, y + radius); ++v)
    for (int u = std::max(0, x - radius); u <= std::min(level.depth.cols - 1, x + radius); ++u) {
      float const z = level.depth(v, u);
      if (!std::isfinite(z)) continue;
      int const du = u - x, dv = v - y;
      double const reach = kMaxSlope * pixel * std::max({1, std::abs(du), std::abs(dv)});
      if (std::abs(z - *center) > reach + 4 * level.sigma(v, u)) continue;
      Eigen::Vector3d const row(1, du, dv);
      normal_matrix += row * row.transpose();
      double const difference = linear_depth(camera, z) - scale;
      right += row * difference;
      squares += difference * difference;
      sigma_sum += level.sigma(v, u);
      ++count;
    }
  int const full = (2 * radius + 1) * (2 * radius + 1);
  if (count < std::max(6, full * 3 / 10)) return;
  double const off_center = std::hypot(normal_matrix(0, 1), normal_matrix(0, 2)) / count;
  if (off_center > 0.26 * radius) return;
  Eigen::LDLT<Eigen::Matrix3d> const solver(normal_matrix);
  if (solver.vectorD().minCoeff() < 1e-6 * count) return;
  Eigen::Vector3d const plane = solver.solve(right);
  double const at_pixel = plane[0] + scale;
  double const z = linear_depth(camera, at_pixel);
  if (!std::isfinite(z) || (camera.is_perspective() && z <= 0)) return;
  Eigen::Vector3d normal;
  if (camera.is_perspective())
    normal = -Eigen::Vector3d(plane[1] * camera.fx(), plane[2] * camera.fy(),
                              at_pixel + plane[1] * (camera.cx() - x) + plane[2] * (camera.cy() - y));
  else
    normal = Eigen::Vector3d(plane[1] * camera.fx(), plane[2] * camera.fy(), -1);
  normal.normalize();
  if (-normal.dot(camera.ray_direction(x, y).normalized()) < kMinCosine) return;
  // The plane is right about direction, but cuts off curvature, the more so the more a view sees at a slant: that would
  // pull views together. So depths stay as they were measured, and the plane only fills holes.
  float const own = level.depth(y, x);
  surface.depth(y, x) = std::isfinite(own) ? own : static_cast<float>(z);
  surface.normal(y, x) =
      cv::Vec3f(static_cast<float>(normal.x()), static_cast<float>(normal.y()), static_cast<float>(normal.z()));
  surface.sigma(y, x) = static_cast<float>(sigma_sum / count);
  if (is_crease(level, squares - plane.dot(right), count, z, sigma_sum / count)) surface.crease(y, x) = 255;
}

void add_tone(Level const& level, ViewSurface& surface) {
  cv::Size const size = level.depth.size();
  cv::Mat1f inside(size, 0.0f), masked(size, 0.0f);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (std::isfinite(level.depth(y, x)) || std::isfinite(surface.depth(y, x))) {
        inside(y, x) = 1;
        masked(y, x) = level.brightness(y, x);
      }
  cv::Mat1f blurred, weight, smooth, smooth_weight;
  cv::GaussianBlur(masked, blurred, {}, kToneBlur);
  cv::GaussianBlur(inside, weight, {}, kToneBlur);
  cv::GaussianBlur(masked, smooth, {}, 0.7);
  cv::GaussianBlur(inside, smooth_weight, {}, 0.7);
  surface.tone = cv::Mat1f(size, nan_f());
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (inside(y, x) > 0) surface.tone(y, x) = smooth(y, x) / smooth_weight(y, x) - blurred(y, x) / weight(y, x);
  surface.tone_gradient = cv::Mat2f(size, cv::Vec2f(nan_f(), nan_f()));
  for (int y = 1; y + 1 < size.height; ++y)
    for (int x = 1; x + 1 < size.width; ++x)
      surface.tone_gradient(y, x) = cv::Vec2f((surface.tone(y, x + 1) - surface.tone(y, x - 1)) / 2,
                                              (surface.tone(y + 1, x) - surface.tone(y - 1, x)) / 2);
}

void gather_samples(Level const& level, std::size_t max_samples, ViewSurface& surface) {
  std::size_t const count = static_cast<std::size_t>(cv::countNonZero(surface.depth == surface.depth));
  surface.stride = 1;
  while (count / static_cast<std::size_t>(surface.stride * surface.stride) > max_samples) ++surface.stride;
  for (int y = 0; y < surface.depth.rows; y += surface.stride)
    for (int x = 0; x < surface.depth.cols; x += surface.stride) {
      float const z = surface.depth(y, x);
      if (!std::isfinite(z) || !std::isfinite(level.depth(y, x))) continue;
      cv::Vec3f const& n = surface.normal(y, x);
      SurfaceSample sample{surface.camera.unproject(x, y, z), {n[0], n[1], n[2]}, surface.sigma(y, x), nan_f(), x, y,
                           surface.crease(y, x) != 0};
      if (!surface.tone.empty()) sample.tone = surface.tone(y, x);
      surface.samples.push_back(sample);
    }
}

ViewSurface fit_surface(Level const& level, bool finest) {
  ViewSurface surface;
  surface.camera = level.camera;
  surface.depth = cv::Mat1f(level.depth.size(), nan_f());
  surface.normal = cv::Mat3f(level.depth.size(), cv::Vec3f::all(nan_f()));
  surface.sigma = cv::Mat1f(level.depth.size(), nan_f());
  surface.crease = cv::Mat1b(level.depth.size(), uchar{0});
  int const radius = window_radius(level);
  for (int y = 0; y < level.depth.rows; ++y)
    for (int x = 0; x < level.depth.cols; ++x) fit_pixel(level, radius, x, y, surface);
  // On a coarse level, and on a surface that is rough everywhere, there is nothing better to be had.
  int const creased = cv::countNonZero(surface.crease), all = cv::countNonZero(surface.depth == surface.depth);
  if (!finest || creased > all / 2) surface.crease.setTo(0);
  return surface;
}

// Is the brightness nothing but a function of the normal? Then it is shading (a scan drawn without colour, or a plain
// surface under a lamp): it belongs to the light, not to the surface, and must not hold views together. Least squares
// on the nine spherical harmonics up to degree 2 (Ramamoorthi and Hanrahan 2001).
bool is_only_shading(Level const& level, ViewSurface const& surface) {
  using Vector9d = Eigen::Matrix<double, 9, 1>;
  Eigen::Matrix<double, 9, 9> normal_matrix = Eigen::Matrix<double, 9, 9>::Zero();
  Vector9d right = Vector9d::Zero();
  double sum = 0, squares = 0, count = 0;
  for (int y = 0; y < surface.depth.rows; ++y)
    for (int x = 0; x < surface.depth.cols; ++x) {
      if (!std::isfinite(surface.depth(y, x))) continue;
      double const a = surface.normal(y, x)[0], b = surface.normal(y, x)[1], c = surface.normal(y, x)[2];
      Vector9d row;
      row << 1, a, b, c, a * b, a * c, b * c, a * a - b * b, 3 * c * c - 1;
      double const value = std::exp(level.brightness(y, x));
      normal_matrix += row * row.transpose();
      right += row * value;
      sum += value;
      squares += value * value;
      ++count;
    }
  if (count < 50) return false;
  double const variance = squares - sum * sum / count;
  if (variance <= 1e-6 * count) return true;
  normal_matrix.diagonal().array() += 1e-6 * count;
  double const explained = right.dot(normal_matrix.ldlt().solve(right)) - sum * sum / count;
  return explained > 0.8 * variance;
}

}  // namespace

SampleGrid::SampleGrid(ViewSurface const& surface, std::size_t at_most) {
  int factor = 1;
  while (surface.samples.size() > at_most * static_cast<std::size_t>(factor * factor)) ++factor;
  pitch_ = factor * surface.stride;
}

SurfacePyramid build_pyramid(RangeImage const& image, PyramidOptions const& options) {
  SurfacePyramid pyramid;
  Level level = finest_level(image);
  std::vector<Level> levels;
  for (int l = 0;; ++l) {
    levels.push_back(level);
    int const side = std::min(level.depth.cols, level.depth.rows);
    if (l + 1 >= options.levels || side / 2 < kMinLevelSide) break;
    level = coarser(level);
  }
  for (Level const& l : levels) pyramid.levels.push_back(fit_surface(l, pyramid.levels.empty()));
  bool const colored =
      !image.color.empty() && !is_drawn_shading(image) && !is_only_shading(levels.back(), pyramid.levels.back());
  for (std::size_t l = 0; l < levels.size(); ++l) {
    if (colored) add_tone(levels[l], pyramid.levels[l]);
    gather_samples(levels[l], options.max_samples, pyramid.levels[l]);
  }

  std::vector<double> xs, ys, zs, distances;
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x) {
      if (!image.has_depth(x, y)) continue;
      ++pyramid.depths;
      if ((x + y) % 2) continue;
      Eigen::Vector3d const p = image.point(x, y);
      xs.push_back(p.x());
      ys.push_back(p.y());
      zs.push_back(p.z());
    }
  std::vector<double> const px = xs, py = ys, pz = zs;
  pyramid.centroid = {median_of(xs), median_of(ys), median_of(zs)};
  for (std::size_t i = 0; i < px.size(); ++i)
    distances.push_back((Eigen::Vector3d(px[i], py[i], pz[i]) - pyramid.centroid).norm());
  if (!distances.empty()) {
    auto const at = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() * 95 / 100);
    std::nth_element(distances.begin(), at, distances.end());
    pyramid.radius = *at;
  }
  return pyramid;
}

}  // namespace scanview
