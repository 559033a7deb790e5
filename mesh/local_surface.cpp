#include "mesh/local_surface.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

namespace scanview {
namespace {

constexpr int kRadius = 2;
constexpr int kSide = 2 * kRadius + 1;
constexpr int kEnoughToJudge = 8;  // pixels, against three unknowns
constexpr double kAgrees = 1.3;    // rms residual in sigma: 8 pixels of pure noise exceed it in 1 of 100 cases

struct Sample {
  int dx, dy;
  double depth;  // linear
  double sigma;  // of the linear depth
};

/// Breadth first over links, so that the fit never reaches around a step edge that ends outside the window.
int collect(RangeImage const& image, SurfaceLinks const& links, int x, int y, std::array<Sample, kSide * kSide>& out) {
  std::array<bool, kSide * kSide> seen{};
  int count = 0, next = 0;
  auto add = [&](int dx, int dy) {
    seen[(dy + kRadius) * kSide + dx + kRadius] = true;
    double const z = image.depth(y + dy, x + dx), sigma = image.sigma(y + dy, x + dx);
    double const q = linear_depth(image.camera, z);
    out[count++] = {dx, dy, q, image.camera.is_perspective() ? sigma * q * q : sigma};
  };
  add(0, 0);
  for (; next < count; ++next) {
    Sample const from = out[next];
    constexpr int steps[4][2] = {{1, 0}, {-1, 0}, {0, 1}, {0, -1}};
    for (auto const& [sx, sy] : steps) {
      int const dx = from.dx + sx, dy = from.dy + sy;
      if (std::max(std::abs(dx), std::abs(dy)) > kRadius || !links.is_object(x + dx, y + dy)) continue;
      if (seen[(dy + kRadius) * kSide + dx + kRadius]) continue;
      if (links.linked(x + from.dx, y + from.dy, x + dx, y + dy)) add(dx, dy);
    }
  }
  return count;
}

}  // namespace

LocalSurface fit_local_surface(RangeImage const& image, SurfaceLinks const& links, int x, int y, double tolerance) {
  std::array<Sample, kSide * kSide> samples;
  int const count = collect(image, links, x, y, samples);
  LocalSurface surface;
  double const own = samples[0].depth;
  surface.depth = own;
  for (int i = 1; i < count; ++i)
    if (std::max(std::abs(samples[i].dx), std::abs(samples[i].dy)) == 1)
      surface.reach = std::max(surface.reach, std::abs(samples[i].depth - own));
  if (image.camera.is_perspective()) surface.reach = std::min(surface.reach, own / 4);  // stays before the camera
  if (count < 2) return surface;

  // Differences to the pixel's own depth keep the sums small beside large depths; a touch of ridge makes the slope the
  // shortest one where all pixels are in a line.
  Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (int i = 0; i < count; ++i) {
    Eigen::Vector3d const row(1, samples[i].dx, samples[i].dy);
    normal += row * row.transpose();
    right += row * (samples[i].depth - own);
  }
  normal(1, 1) += 1e-6;
  normal(2, 2) += 1e-6;
  Eigen::Vector3d const plane = normal.ldlt().solve(right);
  if (!plane.allFinite()) return surface;
  surface.slope = plane.tail<2>();

  if (count < kEnoughToJudge) return surface;
  double sum = 0;
  for (int i = 0; i < count; ++i) {
    double const fitted = plane.dot(Eigen::Vector3d(1, samples[i].dx, samples[i].dy));
    double const residual = (samples[i].depth - own - fitted) / samples[i].sigma;
    sum += residual * residual;
  }
  double const fitted = own + plane[0];
  if (!(sum <= kAgrees * kAgrees * count) || (image.camera.is_perspective() && fitted <= 0)) return surface;
  double const z = image.depth(y, x), move = linear_depth(image.camera, fitted) - z;
  double const limit = tolerance >= 2 * image.sigma(y, x) ? 0.95 * tolerance : 0.5 * tolerance;
  double const kept = z + std::clamp(move, -limit, limit);
  if (!image.camera.is_perspective() || (kept > z / 2 && kept < 2 * z))
    surface.depth = linear_depth(image.camera, kept);
  return surface;
}

double extend(LocalSurface const& surface, Eigen::Vector2d const& offset) {
  return surface.depth + std::clamp(surface.slope.dot(offset), -surface.reach, surface.reach);
}

}  // namespace scanview
