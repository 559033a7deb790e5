#include "synth/visible_triangles.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "base/parallel.h"

namespace scanview {

std::vector<bool> visible_triangles(RayScene const& scene, std::vector<Eigen::Vector3f> const& vertices,
                                    std::vector<Eigen::Vector3i> const& triangles, Eigen::Vector3d const& eye,
                                    int points, Context& context) {
  Eigen::Vector3f const origin = eye.cast<float>();
  std::vector<std::uint8_t> is_visible(triangles.size());
  constexpr std::size_t kTrianglesATask = 4096;
  for_each_index(context, (triangles.size() + kTrianglesATask - 1) / kTrianglesATask, [&](std::size_t task) {
    std::size_t const end = std::min(triangles.size(), (task + 1) * kTrianglesATask);
    for (std::size_t i = task * kTrianglesATask; i < end; ++i) {
      auto const corner = [&](int k) { return vertices[static_cast<std::size_t>(triangles[i][k])]; };
      Eigen::Vector3f const a = corner(0), ab = corner(1) - a, ac = corner(2) - a;
      for (int first = 0; first < points && is_visible[i] == 0; first += kPacket) {
        RayDirections to_points;
        int const count = std::min(points - first, kPacket);
        for (int k = 0; k < kPacket; ++k) {
          double const n = first + std::min(k, count - 1) + 1;
          double u = std::fmod(0.5 + 0.7548776662466927 * n, 1.0), v = std::fmod(0.5 + 0.5698402909980532 * n, 1.0);
          if (u + v > 1) {
            u = 1 - u;
            v = 1 - v;
          }
          to_points[static_cast<std::size_t>(k)] = a + static_cast<float>(u) * ab + static_cast<float>(v) * ac - origin;
        }
        auto const hits = scene.first_hits(origin, to_points);
        for (int k = 0; k < count; ++k) {
          RayHit const& hit = hits[static_cast<std::size_t>(k)];
          // The ray ends at distance 1; single precision loses the last few bits, and coplanar triangles share it.
          constexpr float kThere = 1 - 1e-5F;
          if (hit.triangle == static_cast<int>(i) || (hit.triangle >= 0 && hit.distance >= kThere)) is_visible[i] = 1;
        }
      }
    }
  });
  return {is_visible.begin(), is_visible.end()};
}

}  // namespace scanview
