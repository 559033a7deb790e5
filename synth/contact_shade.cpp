#include "synth/contact_shade.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr int kPackets = 4;  // of directions

}  // namespace

ContactShade::ContactShade(RayScene const& object, Eigen::Isometry3d const& model_from_room, double radius)
    : radius_(radius), open_(kSide * kSide) {
  std::array<RayDirections, kPackets> sky;
  constexpr int kCount = kPackets * kPacket;
  for (int k = 0; k < kCount; ++k) {
    double const r2 = (k + 0.5) / kCount, a = std::numbers::pi * (3 - std::sqrt(5.0)) * k, r = std::sqrt(r2);
    Vector3d const up(r * std::cos(a), std::sqrt(1 - r2), r * std::sin(a));
    sky[k / kPacket][k % kPacket] = (model_from_room.linear() * up).cast<float>();
  }
  for (int row = 0; row < kSide; ++row)
    for (int column = 0; column < kSide; ++column) {
      Vector3d const p(((column + 0.5) / kSide * 2 - 1) * radius, 0, ((row + 0.5) / kSide * 2 - 1) * radius);
      std::array<Eigen::Vector3f, kPacket> origins;
      origins.fill((model_from_room * p).cast<float>());
      int blocked = 0;
      for (auto const& directions : sky) {
        auto const hits = object.occluded(origins, directions, kPacket, 0);
        blocked += static_cast<int>(std::count(hits.begin(), hits.end(), true));
      }
      open_[static_cast<std::size_t>(row * kSide + column)] = 1 - static_cast<float>(blocked) / kCount;
    }
}

float ContactShade::at(double x, double z) const {
  double const u = (x / radius_ + 1) / 2 * kSide - 0.5, v = (z / radius_ + 1) / 2 * kSide - 0.5;
  if (!(u > -0.5 && v > -0.5 && u < kSide - 0.5 && v < kSide - 0.5)) return 1;
  int const column = std::clamp(static_cast<int>(std::floor(u)), 0, kSide - 2);
  int const row = std::clamp(static_cast<int>(std::floor(v)), 0, kSide - 2);
  auto const a = static_cast<float>(std::clamp(u - column, 0.0, 1.0));
  auto const b = static_cast<float>(std::clamp(v - row, 0.0, 1.0));
  float const* const p = open_.data() + row * kSide + column;
  return (1 - b) * ((1 - a) * p[0] + a * p[1]) + b * ((1 - a) * p[kSide] + a * p[kSide + 1]);
}

}  // namespace scanview
