#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <limits>
#include <memory>
#include <vector>

namespace scanview {

/// Where a ray first met a triangle: the point (1 - u - v) a + u b + v c, at origin + distance * direction.
struct RayHit {
  int triangle = -1;  ///< -1: nothing
  float u = 0, v = 0;
  float distance = 0;
};

inline constexpr int kPacket = 16;
using RayDirections = std::array<Eigen::Vector3f, kPacket>;

/// Triangles ready for casting rays at (Embree). All queries may be called from several threads at once and give the
/// same answer whatever the number of threads.
class RayScene {
 public:
  RayScene(std::vector<Eigen::Vector3f> const& vertices, std::vector<Eigen::Vector3i> const& triangles);
  ~RayScene();
  RayScene(RayScene const&) = delete;
  RayScene& operator=(RayScene const&) = delete;

  RayHit first_hit(Eigen::Vector3f const& origin, Eigen::Vector3f const& direction) const;
  std::array<RayHit, kPacket> first_hits(Eigen::Vector3f const& origin, RayDirections const& directions) const;
  /// Of the first `count` rays, each from its own origin, what they first meet beyond `nearest`.
  std::array<RayHit, kPacket> first_hits(std::array<Eigen::Vector3f, kPacket> const& origins,
                                         RayDirections const& directions, int count, float nearest) const;
  /// Whether something is between `nearest` and `farthest` along each of the first `count` rays.
  std::array<bool, kPacket> occluded(std::array<Eigen::Vector3f, kPacket> const& origins,
                                     RayDirections const& directions, int count, float nearest,
                                     float farthest = std::numeric_limits<float>::infinity()) const;
  /// How far it is to the nearest point of any triangle; `farthest` (finite) where nothing is nearer.
  float distance(Eigen::Vector3f const& point, float farthest) const;

 private:
  struct Embree;
  std::unique_ptr<Embree> embree_;
};

}  // namespace scanview
