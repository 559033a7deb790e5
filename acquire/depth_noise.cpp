#include "acquire/depth_noise.h"

#include <algorithm>
#include <cmath>

namespace scanview {
namespace {

constexpr double kSteepest = 5.67;  // tan 80 degrees: beyond it a depth says little about the surface
constexpr int kRadius = 3;  // windows of 7x7: noise of neighbours is correlated in stereo, so 3x3 sees too little
constexpr int kStride = 3;
constexpr std::size_t kFewestWindows = 100;

/// RMS residual of the plane z = a + b x + c y through a full window, by the closed form on a centred grid; negative
/// where a depth is missing or a step runs through.
double plane_residual(RangeImage const& image, int x, int y, double sigma) {
  double sum = 0, sum_x = 0, sum_y = 0;
  double const z0 = image.depth(y, x);
  for (int dy = -kRadius; dy <= kRadius; ++dy)
    for (int dx = -kRadius; dx <= kRadius; ++dx) {
      double const z = image.depth(y + dy, x + dx) - z0;
      if (!(std::abs(z) <= largest_step(image.camera, z0, sigma, sigma, std::hypot(dx, dy)))) return -1;
      sum += z, sum_x += z * dx, sum_y += z * dy;
    }
  constexpr int kSide = 2 * kRadius + 1;
  constexpr double kCount = kSide * kSide;
  constexpr double kMoment = kSide * 2 * (1 * 1 + 2 * 2 + 3 * 3);  // sum of dx^2 over the window
  double const mean = sum / kCount, b = sum_x / kMoment, c = sum_y / kMoment;
  double squares = 0;
  for (int dy = -kRadius; dy <= kRadius; ++dy)
    for (int dx = -kRadius; dx <= kRadius; ++dx) {
      double const r = image.depth(y + dy, x + dx) - z0 - mean - b * dx - c * dy;
      squares += r * r;
    }
  return std::sqrt(squares / (kCount - 3));
}

}  // namespace

double DepthNoise::sigma(double z) const {
  double const rounding = quantum / std::sqrt(12.0);
  return std::max(std::hypot(scale * (constant + quadratic * z * z), rounding), 1e-12);
}

DepthNoise sensor_noise(Unit unit, double quantum, double typical_depth) {
  switch (unit) {
    case Unit::m:
      return {.constant = 1e-4, .quadratic = 2e-3, .quantum = quantum};
    case Unit::mm:
      return {.constant = 0.1, .quadratic = 2e-6, .quantum = quantum};
    case Unit::arbitrary:
      break;
  }
  double const z = std::max(std::abs(typical_depth), 1e-9);
  return {.constant = 0, .quadratic = 1e-3 / z, .quantum = quantum};
}

DepthNoise scanner_noise(double spacing) { return {.constant = 0.2 * spacing}; }

double largest_step(Camera const& camera, double z, double sigma_a, double sigma_b, double distance, double sigmas) {
  return sigmas * std::hypot(sigma_a, sigma_b) + kSteepest * camera.pixel_size(z) * distance;
}

double estimate_noise_scale(std::vector<RangeImage const*> const& images, DepthNoise const& noise) {
  std::vector<double> ratios;
  for (RangeImage const* image : images)
    for (int y = kRadius; y + kRadius < image->depth.rows; y += kStride)
      for (int x = kRadius; x + kRadius < image->depth.cols; x += kStride) {
        double const z = image->depth(y, x);
        if (!std::isfinite(z)) continue;
        double const sigma = noise.sigma(z);
        double const residual = plane_residual(*image, x, y, sigma);
        if (residual >= 0) ratios.push_back(residual / sigma);
      }
  if (ratios.size() < kFewestWindows) return 1;
  auto const middle = ratios.begin() + static_cast<std::ptrdiff_t>(ratios.size() / 2);
  std::nth_element(ratios.begin(), middle, ratios.end());
  return std::clamp(*middle, 0.25, 4.0);
}

void apply_noise(RangeImage& image, DepthNoise const& noise) {
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x)
      image.sigma(y, x) = image.has_depth(x, y) ? static_cast<float>(noise.sigma(image.depth(y, x))) : kMissing;
}

}  // namespace scanview
