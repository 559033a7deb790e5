#include "acquire/peak_fit.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

// Eight peaks at once, a lane each: GCC's vector types, which are arrays of registers on a processor without AVX2. No
// multiplication is fused with an addition (-ffp-contract=off), so every processor gives the same bytes.
#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define SCANVIEW_EVERY_PROCESSOR [[gnu::target_clones("avx2", "default")]]
#else
#define SCANVIEW_EVERY_PROCESSOR
#endif
#define SCANVIEW_INLINE [[gnu::always_inline]] inline
#pragma GCC diagnostic ignored "-Wpsabi"  // vectors pass between inlined functions only

namespace scanview {
namespace {

constexpr int kSteps = 12;
constexpr float kNarrowest = 0.2F, kWidest = 8;  // steps
constexpr int kLanes = kPeaksAtOnce;

using Lanes = float __attribute__((vector_size(4 * kLanes)));
using Bits = std::int32_t __attribute__((vector_size(4 * kLanes)));  // a comparison's result: 0 or -1 a lane

SCANVIEW_INLINE Lanes all(float value) { return Lanes{} + value; }
SCANVIEW_INLINE Lanes least(Lanes a, Lanes b) { return a < b ? a : b; }
SCANVIEW_INLINE Lanes greatest(Lanes a, Lanes b) { return a > b ? a : b; }
SCANVIEW_INLINE Lanes clamp(Lanes a, Lanes low, Lanes high) { return least(greatest(a, low), high); }
SCANVIEW_INLINE Lanes size_of(Lanes a) { return a < 0 ? -a : a; }
SCANVIEW_INLINE bool any(Bits bits) {
  std::int32_t together = 0;
  for (int l = 0; l < kLanes; ++l) together |= bits[l];
  return together != 0;
}

/// e^x for x <= 0, to two units in the last place (Cephes' polynomial); below -80 as at -80.
SCANVIEW_INLINE Lanes exponential(Lanes x) {
  constexpr float kRound = 12582912;  // 1.5 * 2^23: adding it rounds to a whole number, which the low bits then hold
  x = greatest(x, all(-80));
  Lanes const shifted = x * 1.44269504F + kRound;
  Lanes const n = shifted - kRound;
  Lanes const r = x - n * 0.693359375F + n * 2.12194440e-4F;
  Lanes y = r * 1.9875691500e-4F + 1.3981999507e-3F;
  y = y * r + 8.3334519073e-3F;
  y = y * r + 4.1665795894e-2F;
  y = y * r + 1.6666665459e-1F;
  y = y * r + 5.0000001201e-1F;
  y = y * r * r + r + 1.0F;
  Bits const power = (reinterpret_cast<Bits>(shifted) - 0x4B400000 + 127) << 23;
  return y * reinterpret_cast<Lanes>(power);
}

struct Samples {
  Lanes value[PeakSamples::kMost], use[PeakSamples::kMost];  // use: 1 or 0
  int count = 0;
};

struct Model {
  Lanes ambient{}, height{}, time{}, width{};
};

/// Where a parabola through the logarithms of three values has its top, and the Gaussian's width; the middle one where
/// the values are no peak.
void start(PeakSamples const& s, int top, int lane, Model& model) {
  float least = s.value[0];
  for (int i = 1; i < s.count; ++i) least = std::min(least, s.value[i]);
  float const height = std::max(s.value[top] - least, 1.0F);
  float time = static_cast<float>(top), width = 1;
  if (top > 0 && top + 1 < s.count && s.usable[top - 1] && s.usable[top] && s.usable[top + 1]) {
    float const floor = 0.02F * height;
    float const before = std::log(std::max(s.value[top - 1] - least, floor) / height);
    float const after = std::log(std::max(s.value[top + 1] - least, floor) / height);
    float const bend = before + after;  // second difference; the middle's logarithm is 0
    if (bend < -1e-3F) {
      time += std::clamp(0.5F * (before - after) / bend, -0.7F, 0.7F);
      width = std::clamp(std::sqrt(-1 / bend), 0.4F, 3.0F);
    }
  }
  model.ambient[lane] = least, model.height[lane] = height, model.time[lane] = time, model.width[lane] = width;
}

/// Normal equations of the four parameters at a model (ambient, height, time, width), and the weighted sum of squares.
/// The matrix's upper triangle, row by row. Written out: this is what decoding a sweep spends its time with.
struct Normal {
  Lanes m[10]{};
  Lanes g[4]{};
  Lanes cost{};
};

SCANVIEW_INLINE Normal linearise(Samples const& s, Model const& model, PixelNoise const& noise,
                                 WidthPrior const& prior) {
  Normal n;
  Lanes const over = 1.0F / model.width;
  auto const read = static_cast<float>(noise.read), gain = static_cast<float>(noise.gain);
  for (int i = 0; i < s.count; ++i) {
    Lanes const u = (static_cast<float>(i) - model.time) * over;
    Lanes const e = exponential(-0.5F * u * u);
    Lanes const expected = model.ambient + model.height * e;
    Lanes const weight = s.use[i] / (read + gain * greatest(expected, Lanes{}));
    Lanes const residual = s.value[i] - expected;
    Lanes const t = model.height * e * u * over, w = t * u;
    Lanes const we = weight * e, wt = weight * t, ww = weight * w, wr = weight * residual;
    n.m[0] += weight, n.m[1] += we, n.m[2] += wt, n.m[3] += ww;
    n.m[4] += we * e, n.m[5] += we * t, n.m[6] += we * w;
    n.m[7] += wt * t, n.m[8] += wt * w;
    n.m[9] += ww * w;
    n.g[0] += wr, n.g[1] += wr * e, n.g[2] += wr * t, n.g[3] += wr * w;
    n.cost += wr * residual;
  }
  auto const tie = static_cast<float>(1 / (prior.sigma * prior.sigma));
  n.m[9] += tie;
  n.g[3] += tie * (static_cast<float>(prior.width) - model.width);
  return n;
}

/// Place of (i, j), i <= j, in a triangle stored row by row.
constexpr int place(int i, int j) { return i * 4 - i * (i + 1) / 2 + j; }

/// Factors L D L' of the damped matrix, in place of its upper triangle: D's inverse on the diagonal, D L' beside it.
/// The lanes whose matrix is positive.
SCANVIEW_INLINE Bits factorise(Lanes* m, Lanes damping) {
  Bits positive = ~Bits{};
  for (int i = 0; i < 4; ++i) {
    Lanes d = m[place(i, i)] * (1.0F + damping);
    for (int k = 0; k < i; ++k) d -= m[place(k, i)] * m[place(k, i)] * m[place(k, k)];
    positive &= d > 0;
    m[place(i, i)] = 1.0F / d;
    for (int j = i + 1; j < 4; ++j)
      for (int k = 0; k < i; ++k) m[place(i, j)] -= m[place(k, i)] * m[place(k, j)] * m[place(k, k)];
  }
  return positive;
}

SCANVIEW_INLINE void solve(Lanes const* m, Lanes* x) {
  for (int i = 1; i < 4; ++i)
    for (int k = 0; k < i; ++k) x[i] -= m[place(k, i)] * m[place(k, k)] * x[k];
  for (int i = 3; i >= 0; --i) {
    for (int k = i + 1; k < 4; ++k) x[i] -= m[place(i, k)] * x[k];
    x[i] *= m[place(i, i)];
  }
}

struct Fit {
  Model model;
  Lanes time_variance{}, cost{};
  Bits converged{}, regular{};
  Lanes leverage[PeakSamples::kMost];
};

/// Share of each sample's own residual that the fit took up: weight · row' covariance row.
SCANVIEW_INLINE void fill_leverage(Samples const& s, PixelNoise const& noise, Lanes const* factor, Fit& fit) {
  Model const& model = fit.model;
  auto const read = static_cast<float>(noise.read), gain = static_cast<float>(noise.gain);
  for (int i = 0; i < s.count; ++i) {
    Lanes const u = (static_cast<float>(i) - model.time) / model.width, e = exponential(-0.5F * u * u);
    Lanes const t = model.height * e * u / model.width;
    Lanes const row[4] = {all(1), e, t, t * u};
    Lanes x[4] = {row[0], row[1], row[2], row[3]};
    solve(factor, x);
    Lanes const variance = read + gain * greatest(model.ambient + model.height * e, Lanes{});
    fit.leverage[i] = s.use[i] * (row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3] * x[3]) / variance;
  }
}

/// From fit.model on.
SCANVIEW_EVERY_PROCESSOR void optimise(Samples const& samples, PixelNoise const& noise, WidthPrior const& prior,
                                       PeakDetail detail, Fit& fit) {
  Model& model = fit.model;
  Normal normal = linearise(samples, model, noise, prior);
  Lanes damping = all(1e-3F);
  Bits active = ~Bits{};
  for (int step = 0; step < kSteps && any(active); ++step) {
    Normal damped = normal;
    active &= factorise(damped.m, damping);
    Lanes* const change = damped.g;
    solve(damped.m, change);
    Model const next{model.ambient + change[0], model.height + change[1],
                     model.time + clamp(change[2], all(-0.7F), all(0.7F)),
                     clamp(model.width + change[3], 0.6F * model.width, 1.6F * model.width)};
    Normal const there = linearise(samples, next, noise, prior);
    // The variances are the model's own, so the sum of squares may rise a little on the way to the likelihood's top.
    Bits const better = there.cost < 1.5F * normal.cost + 1.0F;
    Bits const taken = active & better, refused = active & ~better;
    fit.converged |= taken & (size_of(change[2]) < 2e-3F) & (size_of(change[3]) < 1e-2F);
    auto const take = [&](Lanes& old, Lanes const& now) { old = taken ? now : old; };
    take(model.ambient, next.ambient), take(model.height, next.height), take(model.time, next.time);
    take(model.width, clamp(next.width, all(kNarrowest), all(kWidest)));
    for (int k = 0; k < 10; ++k) take(normal.m[k], there.m[k]);
    for (int k = 0; k < 4; ++k) take(normal.g[k], there.g[k]);
    take(normal.cost, there.cost);
    damping = taken ? 0.1F * damping : refused ? 10.0F * damping : damping;
    active &= ~fit.converged & (damping <= 1e4F);
  }
  fit.cost = normal.cost;
  fit.regular = factorise(normal.m, Lanes{});
  Lanes column[4] = {Lanes{}, Lanes{}, all(1), Lanes{}};
  solve(normal.m, column);
  fit.time_variance = column[2];
  if (detail == PeakDetail::with_leverage) fill_leverage(samples, noise, normal.m, fit);
}

}  // namespace

void fit_peaks(PeakSamples const* samples, int count, double start_time, PixelNoise const& noise,
               WidthPrior const& prior, Peak* peaks, PeakDetail detail) {
  Samples lanes;
  Fit fit;
  lanes.count = samples[0].count;
  for (int l = 0; l < kLanes; ++l) {
    PeakSamples const& s = samples[std::min(l, count - 1)];  // lanes to spare repeat the last one
    start(s, static_cast<int>(start_time), l, fit.model);
    for (int i = 0; i < lanes.count; ++i) {
      lanes.value[i][l] = s.value[i];
      lanes.use[i][l] = s.usable[i] ? 1 : 0;
    }
  }
  optimise(lanes, noise, prior, detail, fit);
  for (int l = 0; l < count; ++l) {
    Peak& peak = peaks[l];
    peak = {};
    peak.ambient = fit.model.ambient[l], peak.height = fit.model.height[l];
    peak.time = fit.model.time[l], peak.width = fit.model.width[l];
    peak.time_sigma = fit.regular[l] ? std::sqrt(static_cast<double>(fit.time_variance[l]))
                                     : std::numeric_limits<double>::quiet_NaN();
    peak.chi_square = fit.cost[l];
    for (int i = 0; i < lanes.count; ++i) peak.degrees_of_freedom += samples[l].usable[i];
    peak.degrees_of_freedom -= 4;
    peak.converged = fit.converged[l] && std::isfinite(peak.time_sigma) && peak.height > 0;
    if (peak.converged && detail == PeakDetail::with_leverage)
      for (int i = 0; i < lanes.count; ++i) peak.leverage[i] = fit.leverage[i][l];
  }
}

}  // namespace scanview
