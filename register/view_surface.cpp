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
constexpr double kPointsOfCentroid = 10000;  // a median of so many is good to a hundredth of the radius
constexpr float kToneBlur = 6.0f;            // pixels of the level

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

// Linear depth around a pixel: value + slope_u du + slope_v dv.
struct Plane {
  double value = 0, slope_u = 0, slope_v = 0;
  double sigma = 0;   // mean over the window
  double misfit = 0;  // RMS, units of z
};

bool is_crease(Level const& level, Plane const& plane, double z) {
  return plane.misfit > std::hypot(2 * plane.sigma, kCreaseMisfit * level.camera.pixel_size(z));
}

// A change of linear depth as a change of z.
double units_of(Camera const& camera, double z) { return camera.is_perspective() ? z * z : 1.0; }

// The surface around one pixel, gathered depth by depth where the window is not whole or holds more than one surface.
std::optional<Plane> gather_plane(Level const& level, int radius, int x, int y, double center) {
  Camera const& camera = level.camera;
  double const step = kMaxSlope * camera.pixel_size(center), scale = linear_depth(camera, center);
  double n = 0, su = 0, sv = 0, suu = 0, suv = 0, svv = 0, sl = 0, sul = 0, svl = 0, sll = 0, sigma_sum = 0;
  for (int v = std::max(0, y - radius); v <= std::min(level.depth.rows - 1, y + radius); ++v)
    for (int u = std::max(0, x - radius); u <= std::min(level.depth.cols - 1, x + radius); ++u) {
      float const z = level.depth(v, u);
      if (!std::isfinite(z)) continue;
      double const du = u - x, dv = v - y;
      double const reach = step * std::max({1.0, std::abs(du), std::abs(dv)});
      if (std::abs(z - center) > reach + 4 * level.sigma(v, u)) continue;
      double const l = linear_depth(camera, z) - scale;
      n += 1, su += du, sv += dv, suu += du * du, suv += du * dv, svv += dv * dv;
      sl += l, sul += du * l, svl += dv * l, sll += l * l;
      sigma_sum += level.sigma(v, u);
    }
  int const full = (2 * radius + 1) * (2 * radius + 1);
  if (n < std::max(6, full * 3 / 10)) return std::nullopt;
  if (std::hypot(su, sv) / n > 0.26 * radius) return std::nullopt;
  Eigen::Matrix3d normal_matrix;
  normal_matrix << n, su, sv, su, suu, suv, sv, suv, svv;
  Eigen::Vector3d const right(sl, sul, svl);
  Eigen::LDLT<Eigen::Matrix3d> const solver(normal_matrix);
  if (solver.vectorD().minCoeff() < 1e-6 * n) return std::nullopt;
  Eigen::Vector3d const plane = solver.solve(right);
  double const rest = std::sqrt(std::max(0.0, sll - plane.dot(right)) / n) * units_of(camera, center);
  return Plane{plane[0] + scale, plane[1], plane[2], sigma_sum / n, rest};
}

// Sums over whole windows of every pixel, rows first, then columns; NaN where a depth of the window is missing.
class WindowSums {
 public:
  WindowSums(Level const& level, int radius) : level_(level), radius_(radius), rows_(2 * radius + 1) {
    for (Row& row : rows_)
      for (auto* const sum : {&row.l, &row.ul, &row.ll, &row.sigma})
        sum->assign(static_cast<std::size_t>(level.depth.cols), kMissing);
    for (auto* const sum : {&l_, &ul_, &vl_, &ll_, &sigma_}) sum->resize(static_cast<std::size_t>(level.depth.cols));
  }

  /// Rows must come in order from 0.
  void go_to_row(int y) {
    for (; next_ <= std::min(y + radius_, level_.depth.rows - 1); ++next_) add_row(next_);
    std::size_t const width = l_.size();
    for (auto* const sum : {&l_, &ul_, &vl_, &ll_, &sigma_}) std::fill(sum->begin(), sum->end(), 0.0);
    is_whole_ = y >= radius_ && y + radius_ < level_.depth.rows;
    if (!is_whole_) return;
    for (int dv = -radius_; dv <= radius_; ++dv) {
      Row const& row = row_of(y + dv);
      double const factor = dv;
      for (std::size_t x = 0; x < width; ++x) {
        l_[x] += row.l[x];
        ul_[x] += row.ul[x];
        vl_[x] += factor * row.l[x];
        ll_[x] += row.ll[x];
        sigma_[x] += row.sigma[x];
      }
    }
  }

  /// Of the row gone to last; nothing where the window is not whole.
  std::optional<Plane> plane(int x, double z) const {
    auto const at = static_cast<std::size_t>(x);
    if (!is_whole_ || !std::isfinite(l_[at])) return std::nullopt;
    double const side = 2 * radius_ + 1, count = side * side, squares = count * (radius_ * (radius_ + 1.0)) / 3;
    double const mean = l_[at] / count, slope_u = ul_[at] / squares, slope_v = vl_[at] / squares;
    double const rest = ll_[at] - count * mean * mean - squares * (slope_u * slope_u + slope_v * slope_v);
    return Plane{mean, slope_u, slope_v, sigma_[at] / count,
                 std::sqrt(std::max(0.0, rest) / count) * units_of(level_.camera, z)};
  }

 private:
  struct Row {
    std::vector<double> l, ul, ll, sigma;
  };
  Row& row_of(int y) { return rows_[static_cast<std::size_t>(y % (2 * radius_ + 1))]; }

  void add_row(int y) {
    int const width = level_.depth.cols;
    linear_.resize(static_cast<std::size_t>(width));
    float const* const depth = level_.depth.ptr<float>(y);
    float const* const noise = level_.sigma.ptr<float>(y);
    bool const inverse = level_.camera.is_perspective();
    for (int x = 0; x < width; ++x) linear_[static_cast<std::size_t>(x)] = inverse ? 1.0 / depth[x] : depth[x];
    Row& row = row_of(y);
    for (auto* const sum : {&row.l, &row.ul, &row.ll, &row.sigma}) std::fill(sum->begin(), sum->end(), 0.0);
    std::fill(row.l.begin(), row.l.begin() + std::min(radius_, width), kMissing);
    std::fill(row.l.end() - std::min(radius_, width), row.l.end(), kMissing);
    for (int du = -radius_; du <= radius_; ++du) {
      double const factor = du;
      double const* const l = linear_.data() + du;
      float const* const s = noise + du;
      double *const sl = row.l.data(), *const sul = row.ul.data(), *const sll = row.ll.data(),
                    *const ss = row.sigma.data();
      for (int x = radius_; x < width - radius_; ++x) {
        sl[x] += l[x];
        sul[x] += factor * l[x];
        sll[x] += l[x] * l[x];
        ss[x] += s[x];
      }
    }
  }

  Level const& level_;
  int radius_;
  std::vector<Row> rows_;
  std::vector<double> linear_;
  std::vector<double> l_, ul_, vl_, ll_, sigma_;
  int next_ = 0;
  bool is_whole_ = false;
};

bool set_pixel(Level const& level, Plane const& plane, int x, int y, SurfacePixel& pixel) {
  Camera const& camera = level.camera;
  if (!std::isfinite(plane.value) || (camera.is_perspective() && plane.value <= 0)) return false;
  Eigen::Vector3d const ray = camera.ray_direction(x, y);
  Eigen::Vector3d normal;
  if (camera.is_perspective())
    normal = -Eigen::Vector3d(plane.slope_u * camera.fx(), plane.slope_v * camera.fy(),
                              plane.value + plane.slope_u * (camera.cx() - x) + plane.slope_v * (camera.cy() - y));
  else
    normal = Eigen::Vector3d(plane.slope_u * camera.fx(), plane.slope_v * camera.fy(), -1);
  normal.normalize();
  if (-normal.dot(ray) < kMinCosine * ray.norm()) return false;
  // The plane is right about direction, but cuts off curvature, the more so the more a view sees at a slant: that would
  // pull views together. So depths stay as they were measured, and the plane only fills holes.
  float const own = level.depth(y, x);
  pixel.linear_depth = static_cast<float>(std::isfinite(own) ? linear_depth(camera, own) : plane.value);
  for (int k = 0; k < 3; ++k) pixel.normal[k] = static_cast<float>(normal[k]);
  pixel.sigma = static_cast<float>(plane.sigma);
  pixel.crease = is_crease(level, plane, linear_depth(camera, plane.value));
  return true;
}

void add_tone(Level const& level, ViewSurface& surface) {
  cv::Size const size = level.depth.size();
  cv::Mat1f inside(size, 0.0f), masked(size, 0.0f);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      if (std::isfinite(level.depth(y, x)) || surface.has_surface(x, y)) {
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
  std::size_t const count = static_cast<std::size_t>(std::count_if(
      surface.pixels.begin(), surface.pixels.end(), [](SurfacePixel const& pixel) { return pixel.has_surface(); }));
  surface.stride = 1;
  while (count / static_cast<std::size_t>(surface.stride * surface.stride) > max_samples) ++surface.stride;
  surface.samples.reserve(count / static_cast<std::size_t>(surface.stride * surface.stride));
  for (int y = 0; y < level.depth.rows; y += surface.stride)
    for (int x = 0; x < level.depth.cols; x += surface.stride) {
      SurfacePixel const& pixel = surface.at(x, y);
      if (!pixel.has_surface() || !std::isfinite(level.depth(y, x))) continue;
      Eigen::Vector3d const normal(pixel.normal[0], pixel.normal[1], pixel.normal[2]);
      SurfaceSample sample{surface.camera.unproject(x, y, level.depth(y, x)),
                           normal,
                           pixel.sigma,
                           static_cast<float>(-normal.dot(surface.camera.ray_direction(x, y).normalized())),
                           nan_f(),
                           x,
                           y,
                           pixel.crease};
      if (!surface.tone.empty()) sample.tone = surface.tone(y, x);
      surface.samples.push_back(sample);
    }
}

// How the slopes change from pixel to pixel: between measured depths the surface bends, and chords would cut it off.
void add_bends(std::vector<cv::Vec2f> const& slopes, ViewSurface& surface) {
  int const width = surface.camera.width(), height = surface.camera.height();
  auto const index = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
  };
  for (int y = 1; y + 1 < height; ++y)
    for (int x = 1; x + 1 < width; ++x) {
      SurfacePixel& pixel = surface.pixels[index(x, y)];
      if (!pixel.has_surface()) continue;
      float const u = (slopes[index(x + 1, y)][0] - slopes[index(x - 1, y)][0]) / 2;
      float const v = (slopes[index(x, y + 1)][1] - slopes[index(x, y - 1)][1]) / 2;
      if (std::isfinite(u)) pixel.bend_u = u;
      if (std::isfinite(v)) pixel.bend_v = v;
    }
}

ViewSurface fit_surface(Level const& level, bool finest) {
  ViewSurface surface;
  surface.camera = level.camera;
  int const width = level.depth.cols, height = level.depth.rows;
  surface.pixels.resize(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::vector<cv::Vec2f> slopes(surface.pixels.size(), cv::Vec2f(nan_f(), nan_f()));
  int const radius = window_radius(level);
  WindowSums sums(level, radius);
  std::size_t creases = 0, all = 0;
  for (int y = 0; y < height; ++y) {
    sums.go_to_row(y);
    for (int x = 0; x < width; ++x) {
      auto const center = window_center(level, x, y);
      if (!center) continue;
      std::optional<Plane> plane = sums.plane(x, *center);
      double const steepest = kMaxSlope * level.camera.pixel_size(*center) / units_of(level.camera, *center);
      // A whole window that is flat holds one surface.
      if (!plane || is_crease(level, *plane, *center) ||
          std::max(std::abs(plane->slope_u), std::abs(plane->slope_v)) > steepest)
        plane = gather_plane(level, radius, x, y, *center);
      auto const at = static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      if (!plane || !set_pixel(level, *plane, x, y, surface.pixels[at])) continue;
      slopes[at] = cv::Vec2f(static_cast<float>(plane->slope_u), static_cast<float>(plane->slope_v));
      creases += surface.pixels[at].crease ? 1 : 0;
      ++all;
    }
  }
  add_bends(slopes, surface);
  // On a coarse level, and on a surface that is rough everywhere, there is nothing better to be had.
  if (!finest || creases > all / 2)
    for (SurfacePixel& pixel : surface.pixels) pixel.crease = false;
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
  for (int y = 0; y < surface.camera.height(); ++y)
    for (int x = 0; x < surface.camera.width(); ++x) {
      if (!surface.has_surface(x, y)) continue;
      float const* const normal = surface.at(x, y).normal;
      double const a = normal[0], b = normal[1], c = normal[2];
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
  pyramid.depths = static_cast<std::size_t>(cv::countNonZero(levels[0].depth == levels[0].depth));
  int const step = std::max(1, static_cast<int>(std::sqrt(static_cast<double>(pyramid.depths) / kPointsOfCentroid)));
  for (int y = 0; y < image.depth.rows; y += step)
    for (int x = y / step % 2; x < image.depth.cols; x += step) {
      if (!image.has_depth(x, y)) continue;
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
