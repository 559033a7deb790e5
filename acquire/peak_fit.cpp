#include "acquire/peak_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanview {
namespace {

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

/// Normal equations of the four parameters at a model (ambient, height, time, width), and the weighted sum of squares.
/// The matrix's upper triangle, row by row. Written out: this is what decoding a sweep spends its time with.
struct Normal {
  float m[10] = {};
  float g[4] = {};
  float cost = 0;
};

Normal linearise(PeakSamples const& s, Model const& model, PixelNoise const& noise, WidthPrior const& prior) {
  Normal n;
  float const over = 1 / model.width;
  auto const read = static_cast<float>(noise.read), gain = static_cast<float>(noise.gain);
  for (int i = 0; i < s.count; ++i) {
    if (!s.usable[i]) continue;
    float const u = (static_cast<float>(i) - model.time) * over;
    float const e = std::exp(-0.5F * u * u);
    float const expected = model.ambient + model.height * e;
    float const weight = 1 / (read + gain * std::max(expected, 0.0F));
    float const residual = s.value[i] - expected;
    float const t = model.height * e * u * over, w = t * u;
    float const we = weight * e, wt = weight * t, ww = weight * w, wr = weight * residual;
    n.m[0] += weight, n.m[1] += we, n.m[2] += wt, n.m[3] += ww;
    n.m[4] += we * e, n.m[5] += we * t, n.m[6] += we * w;
    n.m[7] += wt * t, n.m[8] += wt * w;
    n.m[9] += ww * w;
    n.g[0] += wr, n.g[1] += wr * e, n.g[2] += wr * t, n.g[3] += wr * w;
    n.cost += wr * residual;
  }
  auto const tie = static_cast<float>(1 / (prior.sigma * prior.sigma));
  float const away = static_cast<float>(prior.width) - model.width;
  n.m[9] += tie;
  n.g[3] += tie * away;
  return n;
}

/// Cholesky factor of the damped matrix, in place of its upper triangle (diagonal inverted); false where it is not
/// positive.
bool factorise(float* m, float damping) {
  auto const at = [m](int i, int j) -> float& { return m[i * 4 - i * (i + 1) / 2 + j]; };
  for (int i = 0; i < 4; ++i) {
    float d = at(i, i) * (1 + damping);
    for (int k = 0; k < i; ++k) d -= at(k, i) * at(k, i);
    if (!(d > 0)) return false;
    at(i, i) = 1 / std::sqrt(d);
    for (int j = i + 1; j < 4; ++j) {
      float v = at(i, j);
      for (int k = 0; k < i; ++k) v -= at(k, i) * at(k, j);
      at(i, j) = v * at(i, i);
    }
  }
  return true;
}

void solve(float const* m, float* x) {
  auto const at = [m](int i, int j) { return m[i * 4 - i * (i + 1) / 2 + j]; };
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < i; ++k) x[i] -= at(k, i) * x[k];
    x[i] *= at(i, i);
  }
  for (int i = 3; i >= 0; --i) {
    for (int k = i + 1; k < 4; ++k) x[i] -= at(i, k) * x[k];
    x[i] *= at(i, i);
  }
}

/// Share of each sample's own residual that the fit took up: weight · row' covariance row.
void fill_leverage(PeakSamples const& s, Model const& model, PixelNoise const& noise, float const* factor, Peak& peak) {
  for (int i = 0; i < s.count; ++i) {
    peak.leverage[i] = 0;
    if (!s.usable[i]) continue;
    float const u = (static_cast<float>(i) - model.time) / model.width, e = std::exp(-0.5F * u * u);
    float const t = model.height * e * u / model.width;
    float const row[4] = {1, e, t, t * u};
    float x[4] = {row[0], row[1], row[2], row[3]};
    solve(factor, x);
    double const variance = noise.variance(model.ambient + model.height * e);
    peak.leverage[i] = (row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3] * x[3]) / variance;
  }
}

}  // namespace

Peak fit_peak(PeakSamples const& samples, double start_time, PixelNoise const& noise, WidthPrior const& prior,
              PeakDetail detail) {
  Model model = start(samples, static_cast<int>(start_time));
  Normal normal = linearise(samples, model, noise, prior);
  Peak peak;
  float damping = 1e-3F;
  for (int step = 0; step < kSteps && !peak.converged; ++step) {
    Normal damped = normal;
    if (!factorise(damped.m, damping)) break;
    float* const change = damped.g;
    solve(damped.m, change);
    Model const next{model.ambient + change[0], model.height + change[1],
                     model.time + std::clamp(change[2], -0.7F, 0.7F),
                     std::clamp(model.width + change[3], 0.6F * model.width, 1.6F * model.width)};
    Normal const there = linearise(samples, next, noise, prior);
    // The variances are the model's own, so the sum of squares may rise a little on the way to the likelihood's top.
    if (!(there.cost < 1.5F * normal.cost + 1)) {
      damping *= 10;
      if (damping > 1e4F) break;
      continue;
    }
    peak.converged = std::abs(change[2]) < 2e-3F && std::abs(change[3]) < 1e-2F;
    model = next;
    model.width = std::clamp(model.width, kNarrowest, kWidest);
    damping *= 0.1F;
    normal = there;
  }
  Normal factor = normal;
  bool const regular = factorise(factor.m, 0);
  float column[4] = {0, 0, 1, 0};
  if (regular) solve(factor.m, column);
  peak.ambient = model.ambient, peak.height = model.height, peak.time = model.time, peak.width = model.width;
  peak.time_sigma = regular ? std::sqrt(static_cast<double>(column[2])) : std::numeric_limits<double>::quiet_NaN();
  peak.chi_square = normal.cost;
  for (int i = 0; i < samples.count; ++i) peak.degrees_of_freedom += samples.usable[i];
  peak.degrees_of_freedom -= 4;
  peak.converged = peak.converged && std::isfinite(peak.time_sigma) && peak.height > 0;
  if (peak.converged && detail == PeakDetail::with_leverage) fill_leverage(samples, model, noise, factor.m, peak);
  return peak;
}

}  // namespace scanview
