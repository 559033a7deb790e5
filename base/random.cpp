#include "base/random.h"

#include <cmath>
#include <numbers>

namespace scanview {
namespace {

constexpr std::uint64_t kWeyl = 0x9e3779b97f4a7c15ULL;

std::uint64_t mix(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

}  // namespace

CounterRandom::CounterRandom(std::uint64_t seed, std::uint64_t item, std::uint64_t iteration)
    : state_(mix(mix(mix(seed + kWeyl) + item * kWeyl + 1) + iteration * kWeyl + 2)) {}

std::uint64_t CounterRandom::bits() { return mix(state_ += kWeyl); }

double CounterRandom::uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }

double CounterRandom::normal() {
  double const radius = std::sqrt(-2.0 * std::log1p(-uniform()));
  return radius * std::cos(2.0 * std::numbers::pi * uniform());
}

std::uint32_t CounterRandom::below(std::uint32_t bound) {
  return static_cast<std::uint32_t>(((bits() >> 32) * bound) >> 32);
}

}  // namespace scanview
