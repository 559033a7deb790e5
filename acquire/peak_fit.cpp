#include "acquire/peak_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace scanview {
namespace {

using Eigen::Matrix4f;
using Eigen::Vector4f;

constexpr int kSteps = 12;
constexpr float kNarrowest = 0.2F, kWidest = 8;  // steps

struct Model {
  float ambient, height, time, width;
};

/// Where a parabola through the logarithms of three values has its top, and the Gaussian's width; the middle one where
/// the values are no peak.
Model start(PeakSamples const& s, int top) {
  float least = s.value[0];
  for (int i = 1; i < s.count; ++i) least = std::min(least, s.value[i]);
  float const height = std::max(s.value[top] - least, 1.0F);
  Model model{least, height, static_cast<float>(top), 1};
  if (top > 0 && top + 1 < s.count && s.usable[top - 1] && s.usable[top] && s.usable[top + 1]) {
    float const floor = 0.02F * height;
    float const before = std::log(std::max(s.value[top - 1] - least, floor) / height);
    float const after = std::log(std::max(s.value[top + 1] - least, floor) / height);
    float const bend = before + after;  // second difference; the middle's logarithm is 0
    if (bend < -1e-3F) {
      model.time += std::clamp(0.5F * (before - after) / bend, -0.7F, 0.7F);
      model.width = std::clamp(std::sqrt(-1 / bend), 0.4F, 3.0F);
    }
  }
  return model;
}

/// Normal equations at a model, and the weighted sum of squares there.
struct Normal {
  Matrix4f matrix = Matrix4f::Zero();
  Vector4f gradient = Vector4f::Zero();
  float cost = 0;
};

Normal linearise(PeakSamples const& s, Model const& m, float const* weight, WidthPrior const& prior,
                 Eigen::Matrix<float, 4, PeakSamples::kMost>* rows) {
  Normal n;
  float const over = 1 / m.width;
  for (int i = 0; i < s.count; ++i) {
    if (!s.usable[i]) continue;
    float const u = (static_cast<float>(i) - m.time) * over;
    float const e = std::exp(-0.5F * u * u);
    Vector4f const row(1, e, m.height * e * u * over, m.height * e * u * u * over);
    float const residual = s.value[i] - (m.ambient + m.height * e);
    n.matrix.noalias() += weight[i] * row * row.transpose();
    n.gradient += weight[i] * residual * row;
    n.cost += weight[i] * residual * residual;
    if (rows) rows->col(i) = row;
  }
  auto const tie = static_cast<float>(1 / (prior.sigma * prior.sigma));
  float const away = static_cast<float>(prior.width) - m.width;
  n.matrix(3, 3) += tie;
  n.gradient(3) += tie * away;
  n.cost += tie * away * away;
  return n;
}

void weigh(PeakSamples const& s, Model const& m, PixelNoise const& noise, float* weight) {
  for (int i = 0; i < s.count; ++i) {
    float const u = (static_cast<float>(i) - m.time) / m.width;
    weight[i] = static_cast<float>(1 / noise.variance(m.ambient + m.height * std::exp(-0.5F * u * u)));
  }
}

}  // namespace

Peak fit_peak(PeakSamples const& samples, double start_time, PixelNoise const& noise, WidthPrior const& prior) {
  Model model = start(samples, static_cast<int>(start_time));
  float weight[PeakSamples::kMost];
  weigh(samples, model, noise, weight);
  Normal normal = linearise(samples, model, weight, prior, nullptr);
  Peak peak;
  float damping = 1e-3F;
  for (int step = 0; step < kSteps && !peak.converged; ++step) {
    Matrix4f damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    Vector4f const change = damped.ldlt().solve(normal.gradient);
    Model const next{model.ambient + change(0), model.height + change(1), model.time + change(2),
                     std::clamp(model.width + change(3), kNarrowest, kWidest)};
    Normal const there = linearise(samples, next, weight, prior, nullptr);
    if (!(there.cost < normal.cost)) {
      peak.converged = std::abs(change(2)) < 1e-4F && std::isfinite(there.cost);
      damping *= 10;
      if (damping > 1e4F) break;
      continue;
    }
    peak.converged = std::abs(change(2)) < 1e-3F && std::abs(change(3)) < 1e-2F;
    model = next;
    damping *= 0.1F;
    weigh(samples, model, noise, weight);
    normal = linearise(samples, model, weight, prior, nullptr);
  }
  Eigen::Matrix<float, 4, PeakSamples::kMost> rows;
  weigh(samples, model, noise, weight);
  normal = linearise(samples, model, weight, prior, &rows);
  Eigen::Matrix4d const covariance = normal.matrix.cast<double>().inverse();
  peak.ambient = model.ambient, peak.height = model.height, peak.time = model.time, peak.width = model.width;
  peak.time_sigma = std::sqrt(covariance(2, 2));
  peak.chi_square = normal.cost;
  for (int i = 0; i < samples.count; ++i) {
    peak.degrees_of_freedom += samples.usable[i];
    if (!samples.usable[i]) continue;
    Eigen::Vector4d const row = rows.col(i).cast<double>();
    peak.leverage[i] = static_cast<double>(weight[i]) * row.dot(covariance * row);
  }
  peak.degrees_of_freedom -= 4;
  peak.converged = peak.converged && std::isfinite(peak.time_sigma) && peak.height > 0;
  return peak;
}

}  // namespace scanview
