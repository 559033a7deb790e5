#include "viewer/blend/exposure.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "base/srgb.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
using Terms = CameraLight::Terms;

constexpr double kMostSamples = 400000;
constexpr double kCauchy = 0.1;   ///< of a logarithm: a tenth of the brightness
constexpr double kGrazing = 0.2;  ///< cosine; normals and colours are poor beyond
constexpr int kRounds = 6;        ///< of reweighting; the weights settle within four or five

/// Neither black, whose noise is all there is, nor saturated.
bool usable(cv::Vec3b const& color) {
  for (int c = 0; c < 3; ++c) {
    if (color[c] < 16 || color[c] > 245) return false;
  }
  return true;
}

/// A place that two views see: what the second's colour has more than the first's, R G B, and the difference of the
/// light's terms at its normals.
struct Sample {
  Vector3d difference;
  Terms terms;
};
struct Pair {
  std::size_t a = 0, b = 0;
  std::vector<Sample> samples;
};

void compare(View const& a, View const& b, cv::Mat3f const& normals, double threshold, int stride,
             std::vector<Sample>& samples) {
  auto const& linear = linear_from_srgb8();
  auto const& image_a = a.image;
  auto const& image_b = b.image;
  Eigen::Isometry3d const b_from_a = b.object_from_camera->inverse() * *a.object_from_camera;
  for (int y = 0; y < image_a.camera.height(); y += stride) {
    for (int x = 0; x < image_a.camera.width(); x += stride) {
      if (!image_a.has_depth(x, y)) continue;
      cv::Vec3f const& n = normals(y, x);
      Vector3d const normal_a(n[0], n[1], n[2]), normal_b = b_from_a.linear() * normal_a;
      if (!(normal_a.z() < -kGrazing && normal_b.z() < -kGrazing)) continue;
      Vector3d const p = b_from_a * image_a.point(x, y);
      Eigen::Vector2d const pixel = image_b.camera.project(p);
      if (!pixel.allFinite() || !image_b.camera.contains(pixel)) continue;
      int const u = std::min(static_cast<int>(std::lround(pixel.x())), image_b.camera.width() - 1);
      int const v = std::min(static_cast<int>(std::lround(pixel.y())), image_b.camera.height() - 1);
      if (u < 0 || v < 0 || !image_b.has_depth(u, v) || !(std::abs(p.z() - image_b.depth(v, u)) <= threshold)) continue;
      auto const& color_a = image_a.color(y, x);
      auto const& color_b = image_b.color(v, u);
      if (!usable(color_a) || !usable(color_b)) continue;
      Sample sample;
      for (int c = 0; c < 3; ++c) sample.difference[c] = std::log(linear[color_b[2 - c]] / linear[color_a[2 - c]]);
      sample.terms = CameraLight::terms(normal_b) - CameraLight::terms(normal_a);
      samples.push_back(sample);
    }
  }
}

/// Of one channel: gain_a + colour_a − light_a = gain_b + colour_b − light_b, in logarithms.
struct Solution {
  Eigen::VectorXd gains;
  Terms light = Terms::Zero();
  double squares = 0, weights = 0;  ///< of what is left: robust sums

  double residual(Pair const& pair, Sample const& sample, int channel) const {
    return sample.difference[channel] + gains[static_cast<Eigen::Index>(pair.b)] -
           gains[static_cast<Eigen::Index>(pair.a)] - light.dot(sample.terms);
  }
  double weight(double residual) const { return 1 / (1 + residual * residual / (kCauchy * kCauchy)); }
};

void measure(Solution& solution, std::vector<Pair> const& pairs, int channel) {
  solution.squares = solution.weights = 0;
  for (auto const& pair : pairs) {
    for (auto const& sample : pair.samples) {
      double const residual = solution.residual(pair, sample, channel), weight = solution.weight(residual);
      solution.squares += weight * residual * residual;
      solution.weights += weight;
    }
  }
}

Solution solve(std::vector<Pair> const& pairs, std::size_t views, int channel, bool with_light) {
  auto const n = static_cast<Eigen::Index>(views);
  constexpr Eigen::Index kTerms = CameraLight::kTerms;
  Eigen::Index const size = n + (with_light ? kTerms : 0);
  Solution solution;
  solution.gains = Eigen::VectorXd::Zero(n);
  for (int round = 0; round < kRounds; ++round) {
    Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(size, size);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
    Eigen::VectorXd samples = Eigen::VectorXd::Zero(n);
    double all = 0;
    for (auto const& pair : pairs) {
      // Of one pair's unknowns: (gain_b − gain_a, light).
      Eigen::Matrix<double, kTerms + 1, kTerms + 1> local;
      Eigen::Matrix<double, kTerms + 1, 1> local_right, row;
      local.setZero();
      local_right.setZero();
      double count = 0;
      for (auto const& sample : pair.samples) {
        double const weight = solution.weight(solution.residual(pair, sample, channel));
        row << 1, -sample.terms;
        local.noalias() += weight * row * row.transpose();
        local_right -= weight * sample.difference[channel] * row;
        count += weight;
      }
      auto const a = static_cast<Eigen::Index>(pair.a), b = static_cast<Eigen::Index>(pair.b);
      samples[a] += count;
      samples[b] += count;
      all += count;
      normal(a, a) += local(0, 0);
      normal(b, b) += local(0, 0);
      normal(a, b) -= local(0, 0);
      normal(b, a) -= local(0, 0);
      right[b] += local_right[0];
      right[a] -= local_right[0];
      if (!with_light) continue;
      normal.block<1, kTerms>(b, n) += local.block<1, kTerms>(0, 1);
      normal.block<1, kTerms>(a, n) -= local.block<1, kTerms>(0, 1);
      normal.block<kTerms, kTerms>(n, n) += local.block<kTerms, kTerms>(1, 1);
      right.segment<kTerms>(n) += local_right.tail<kTerms>();
    }
    if (with_light) normal.block(n, 0, kTerms, n) = normal.block(0, n, n, kTerms).transpose();
    for (Eigen::Index i = 0; i < n; ++i) normal(i, i) += 0.01 * samples[i] + 1;
    for (Eigen::Index i = n; i < size; ++i) normal(i, i) += 1e-3 * all + 1;
    Eigen::VectorXd const unknowns = normal.ldlt().solve(right);
    solution.gains = unknowns.head(n);
    if (with_light) solution.light = unknowns.tail<kTerms>();
  }
  measure(solution, pairs, channel);
  return solution;
}

std::vector<Pair> shared_surfaces(ScanSet const& set, double threshold, Context& context) {
  std::size_t const n = set.views.size();
  double pixels = 0;
  for (auto const& view : set.views) pixels += static_cast<double>(view.image.count_depths());
  // As if every view saw all that the others see.
  int const stride =
      std::max(4, static_cast<int>(std::ceil(std::sqrt(pixels * static_cast<double>(n - 1) / kMostSamples))));
  std::vector<Pair> pairs(n * n);
  for_each_index(
      context, n,
      [&](std::size_t a) {
        cv::Mat3f const normals = estimate_normals(set.views[a].image, 3);
        for (std::size_t b = 0; b < n; ++b) {
          if (a == b) continue;
          Pair& pair = pairs[a * n + b];
          pair.a = a;
          pair.b = b;
          compare(set.views[a], set.views[b], normals, threshold, stride, pair.samples);
        }
      },
      "exposure");
  // Fewer samples say nothing about a whole picture.
  constexpr std::size_t kFewest = 20;
  std::erase_if(pairs, [](Pair const& pair) { return pair.samples.size() < kFewest; });
  return pairs;
}

double rms(std::array<Solution, 3> const& channels) {
  double squares = 0, weights = 0;
  for (auto const& channel : channels) {
    squares += channel.squares;
    weights += channel.weights;
  }
  return weights > 0 ? std::sqrt(squares / weights) : std::numeric_limits<double>::quiet_NaN();
}

}  // namespace

void ExposureOptions::validate() const {
  if (std::isnan(threshold)) throw Error(ErrorCode::usage, {}, "threshold is not a number");
  if (!(greatest_gain >= 1)) throw Error(ErrorCode::usage, {}, "greatest_gain must be at least 1");
  if (!(least_explained >= 0 && least_explained <= 1))
    throw Error(ErrorCode::usage, {}, "least_explained must be between 0 and 1");
}

Exposure estimate_exposure(ScanSet const& set, ExposureOptions const& options, Context& context) {
  options.validate();
  if (!set.has_poses()) throw Error(ErrorCode::bad_input, {}, "the set has views without a pose: register it first");
  double threshold = options.threshold >= 0 ? options.threshold : set.error_budget.threshold();
  if (options.threshold < 0 && !(threshold > 0)) threshold = 0.01 * set.radius();

  std::size_t const n = set.views.size();
  auto const pairs = shared_surfaces(set, threshold, context);
  std::array<Solution, 3> nothing, gains, both;
  for_each_index(context, 3, [&](std::size_t c) {
    int const channel = static_cast<int>(c);
    nothing[c].gains = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(n));
    measure(nothing[c], pairs, channel);
    gains[c] = solve(pairs, n, channel, false);
    both[c] = solve(pairs, n, channel, true);
  });
  Exposure exposure;
  exposure.rms_before = rms(nothing);
  exposure.rms_gains = rms(gains);
  exposure.rms_light = rms(both);
  double const left = exposure.rms_light / exposure.rms_gains;
  bool const lit = options.light == ExposureOptions::Light::automatic && left * left < 1 - options.least_explained;
  auto const& chosen = lit ? both : gains;
  if (lit) {
    exposure.light.emplace();
    for (int c = 0; c < 3; ++c) exposure.light->coefficients.col(c) = chosen[static_cast<std::size_t>(c)].light;
  }
  double const most = std::log(options.greatest_gain);
  for (std::size_t i = 0; i < n; ++i) {
    Vector3d gain;
    for (std::size_t c = 0; c < 3; ++c) {
      gain[static_cast<Eigen::Index>(c)] =
          std::exp(std::clamp(chosen[c].gains[static_cast<Eigen::Index>(i)], -most, most));
    }
    exposure.gains.push_back(gain);
  }
  return exposure;
}

}  // namespace scanview
