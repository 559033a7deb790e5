#include "viewer/blend/exposure.h"

#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "base/srgb.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr int kStride = 4;  ///< pixels apart, in x and y

/// Neither black, whose noise is all there is, nor saturated.
bool usable(cv::Vec3b const& color) {
  for (int c = 0; c < 3; ++c) {
    if (color[c] < 16 || color[c] > 245) return false;
  }
  return true;
}

/// Light of the surface that two views share, as each saw it, R G B.
struct Shared {
  Vector3d of_a = Vector3d::Zero(), of_b = Vector3d::Zero();
  double count = 0;
};

Shared compare(View const& a, View const& b, double threshold, std::array<double, 256> const& linear) {
  Shared shared;
  auto const& image_a = a.image;
  auto const& image_b = b.image;
  Eigen::Isometry3d const b_from_a = b.object_from_camera->inverse() * *a.object_from_camera;
  for (int y = 0; y < image_a.camera.height(); y += kStride) {
    for (int x = 0; x < image_a.camera.width(); x += kStride) {
      if (!image_a.has_depth(x, y)) continue;
      Vector3d const p = b_from_a * image_a.point(x, y);
      Eigen::Vector2d const pixel = image_b.camera.project(p);
      if (!pixel.allFinite() || !image_b.camera.contains(pixel)) continue;
      int const u = std::min(static_cast<int>(std::lround(pixel.x())), image_b.camera.width() - 1);
      int const v = std::min(static_cast<int>(std::lround(pixel.y())), image_b.camera.height() - 1);
      if (u < 0 || v < 0 || !image_b.has_depth(u, v) || !(std::abs(p.z() - image_b.depth(v, u)) <= threshold)) continue;
      auto const& color_a = image_a.color(y, x);
      auto const& color_b = image_b.color(v, u);
      if (!usable(color_a) || !usable(color_b)) continue;
      for (int c = 0; c < 3; ++c) {
        shared.of_a[c] += linear[color_a[2 - c]];
        shared.of_b[c] += linear[color_b[2 - c]];
      }
      shared.count += 1;
    }
  }
  return shared;
}

}  // namespace

void ExposureOptions::validate() const {
  if (std::isnan(threshold)) throw Error(ErrorCode::usage, {}, "threshold is not a number");
  if (!(greatest_gain >= 1)) throw Error(ErrorCode::usage, {}, "greatest_gain must be at least 1");
}

std::vector<Vector3d> estimate_gains(ScanSet const& set, ExposureOptions const& options, Context& context) {
  options.validate();
  if (!set.has_poses()) throw Error(ErrorCode::bad_input, {}, "the set has views without a pose: register it first");
  double threshold = options.threshold >= 0 ? options.threshold : set.error_budget.threshold();
  if (options.threshold < 0 && !(threshold > 0)) threshold = 0.01 * set.radius();

  std::size_t const n = set.views.size();
  std::vector<Shared> shared(n * n);
  auto const& linear = linear_from_srgb8();
  for_each_index(
      context, n * n,
      [&](std::size_t i) {
        if (i / n != i % n) shared[i] = compare(set.views[i / n], set.views[i % n], threshold, linear);
      },
      "exposure");

  // Of each pair: gain_a · light_a = gain_b · light_b, in logarithms.
  auto const size = static_cast<Eigen::Index>(n);
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
  Eigen::MatrixX3d right = Eigen::MatrixX3d::Zero(size, 3);
  for (Eigen::Index a = 0; a < size; ++a) {
    double pixels = 0;
    for (Eigen::Index b = 0; b < size; ++b) {
      Shared const& pair = shared[static_cast<std::size_t>(a * size + b)];
      // Fewer say nothing about a whole picture.
      if (pair.count < 20) continue;
      pixels += pair.count;
      Eigen::RowVector3d const difference = (pair.of_b.array() / pair.of_a.array()).log().matrix().transpose();
      normal(a, a) += pair.count;
      normal(b, b) += pair.count;
      normal(a, b) -= pair.count;
      normal(b, a) -= pair.count;
      right.row(a) += pair.count * difference;
      right.row(b) -= pair.count * difference;
    }
    normal(a, a) += 0.01 * pixels + 1;
  }
  Eigen::MatrixX3d const logarithms = normal.ldlt().solve(right);
  double const most = std::log(options.greatest_gain);
  std::vector<Vector3d> gains;
  for (Eigen::Index a = 0; a < size; ++a) {
    gains.emplace_back(logarithms.row(a).transpose().array().max(-most).min(most).exp());
  }
  return gains;
}

}  // namespace scanview
