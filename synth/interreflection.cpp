#include "synth/interreflection.h"

#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr int kPackets = 4;  // of diffuse directions

}  // namespace

void add_interreflection(CaptureScene const& scene, int view, SceneSample const& point, Vector3d const& direction,
                         ProjectedLight const& light, float gloss, float weight, CounterRandom random, float* frames) {
  Vector3d const& n = point.normal;
  Vector3d const side = n.unitOrthogonal(), other = n.cross(side);
  Vector3d const from = point.point + scene.off_surface() * n;
  std::array<Vector3d, kPacket> directions;
  // Directions in proportion to the cosine, spread evenly (golden angle) and turned anew for every pixel: each then
  // brings an equal share of what comes back from the hemisphere.
  double const turn = 2 * std::numbers::pi * random.uniform();
  constexpr int kCount = kPackets * kPacket;
  for (int packet = 0; packet < kPackets; ++packet) {
    for (int i = 0; i < kPacket; ++i) {
      int const k = packet * kPacket + i;
      double const r2 = (k + 0.5) / kCount, angle = turn + std::numbers::pi * (3 - std::sqrt(5.0)) * k;
      double const r = std::sqrt(r2);
      directions[i] = r * std::cos(angle) * side + r * std::sin(angle) * other + std::sqrt(1 - r2) * n;
    }
    for (auto const& met : scene.look(view, from, directions, light))
      if (met.weight > 0) light.add(met.light, weight * point.albedo * met.weight / kCount, frames);
  }
  if (gloss <= 0) return;
  directions.fill((direction - 2 * n.dot(direction) * n).normalized());
  if (directions[0].dot(n) <= 0) return;
  auto const met = scene.look(view, from, directions, light)[0];
  if (met.weight > 0) light.add(met.light, weight * gloss * met.weight, frames);
}

}  // namespace scanview
