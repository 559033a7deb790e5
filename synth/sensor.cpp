#include "synth/sensor.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace scanview {
namespace {

constexpr int kQuantiles = 1 << 14;

/// The standard normal distribution at probability p, by Newton's method on its integral.
double normal_quantile(double p) {
  double x = 0;
  for (int step = 0; step < 60; ++step) {
    double const error = 0.5 * std::erfc(-x / std::numbers::sqrt2) - p;
    double const density = std::exp(-0.5 * x * x) / std::sqrt(2 * std::numbers::pi);
    double const move = std::clamp(error / density, -0.5, 0.5);
    x -= move;
    if (std::abs(move) < 1e-13) break;
  }
  return x;
}

/// Equally probable normal values, scaled so that the sum of two drawn at random has variance 1.
std::vector<float> const& quantiles() {
  static std::vector<float> const table = [] {
    std::vector<double> values(kQuantiles);
    double sum = 0;
    for (int i = 0; i < kQuantiles; ++i) {
      values[i] = normal_quantile((i + 0.5) / kQuantiles);
      sum += values[i] * values[i];
    }
    double const scale = std::sqrt(0.5 * kQuantiles / sum);
    std::vector<float> scaled;
    for (double const value : values) scaled.push_back(static_cast<float>(scale * value));
    return scaled;
  }();
  return table;
}

}  // namespace

Sensor::Sensor(SensorOptions const& options) : options_(options) { quantiles(); }

double Sensor::value(double light) const {
  double const cut = std::clamp(light, 0.0, 1.0);
  return largest() * (options_.gamma == 1 ? cut : std::pow(cut, 1 / options_.gamma));
}

template <class T>
void Sensor::expose_as(float const* light, int count, CounterRandom& random, T* values) const {
  auto const& table = quantiles();
  auto const full = static_cast<float>(options_.full_scale_electrons);
  auto const read_variance = static_cast<float>(options_.read_electrons * options_.read_electrons);
  auto const top = static_cast<float>(largest());
  std::uint64_t bits = 0;
  for (int i = 0; i < count; ++i) {
    float share = light[i];
    if (full > 0) {
      // Two tables' sum is smooth and reaches nearly six standard deviations; half a draw each.
      bits = i % 2 == 0 ? random.bits() : bits >> 32;
      float const normal = table[bits & (kQuantiles - 1)] + table[bits >> 14 & (kQuantiles - 1)];
      share += std::sqrt(share * full + read_variance) * normal / full;
    }
    share = std::clamp(share, 0.0f, 1.0f);
    if (options_.gamma != 1) share = std::pow(share, static_cast<float>(1 / options_.gamma));
    values[i] = static_cast<T>(share * top + 0.5f);
  }
}

void Sensor::expose(float const* light, int count, CounterRandom random, void* values) const {
  if (options_.bits == 16)
    expose_as(light, count, random, static_cast<std::uint16_t*>(values));
  else
    expose_as(light, count, random, static_cast<std::uint8_t*>(values));
}

}  // namespace scanview
