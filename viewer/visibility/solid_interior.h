#pragma once
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <vector>

#include "mesh/triangle_mesh.h"

namespace scanview {

/// A ball.
struct Ball {
  Eigen::Vector3f center = Eigen::Vector3f::Zero();
  float radius = 0;
};

/// Where a mesh is solid, for proofs that something is hidden (Schaufler, Dorsey, Decoret and Sillion 2000 use such
/// voxels). A mesh's holes are closed by fans; a point is inside where the closed surface winds around it (winding
/// number other than 0), whatever crosses itself or is turned over: each line from there to the outside meets the
/// surface, or one of the fans. The fans' balls are the windows through which one may see in.
///
/// Held in voxels, of which those that a triangle may touch are surface; all answers err on the side of "not solid".
class SolidInterior {
 public:
  /// `resolution`: voxels along the longest side.
  SolidInterior(TriangleMesh const& mesh, int resolution);
  /// The radius of a ball around p that lies inside and does not meet the surface, at least; 0 outside.
  float clearance(Eigen::Vector3f const& p) const;
  std::vector<Ball> const& windows() const { return windows_; }
  float voxel() const { return voxel_; }

 private:
  void close_holes(TriangleMesh const& mesh);
  void mark_surface();
  void find_inside();
  void measure_clearance();
  std::size_t at(int x, int y, int z) const {
    return static_cast<std::size_t>(x) +
           static_cast<std::size_t>(size_.x()) *
               (static_cast<std::size_t>(y) + static_cast<std::size_t>(size_.y()) * static_cast<std::size_t>(z));
  }

  std::vector<std::array<Eigen::Vector3f, 3>> triangles_;  ///< with the fans
  std::vector<Ball> windows_;
  Eigen::Vector3f low_ = Eigen::Vector3f::Zero();
  Eigen::Vector3i size_ = Eigen::Vector3i::Zero();
  float voxel_ = 1;
  std::vector<std::uint8_t> kind_;  ///< of a voxel: not known, outside, surface, inside
  std::vector<float> clearance_;
};

}  // namespace scanview
