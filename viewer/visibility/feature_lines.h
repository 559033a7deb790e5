#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/triangle_mesh.h"
#include "viewer/visibility/triangle_planes.h"
#include "viewer/visibility/visibility_selector.h"

namespace scanview {

/// The lines that a draughtsman would draw of a mesh: its silhouette from an eye, its open edges and its creases. Of
/// what an eye can see alone, where it is asked for that: culling makes line drawings cheaper too.
///
/// Vertices of equal positions are one, so that a mesh that repeats them is not all rims. Neighbours that are wound
/// against each other count as if they were not. Triangles without area face nothing: an
/// edge of one is a line only where it is one of theirs alone, or of three.
class FeatureLines {
 public:
  /// crease_angle: radians between the outer normals of an edge's two triangles, above which it is a crease; an edge of
  /// three triangles or more always is one. Throws Error{usage} unless it is from 0 to π. n log n.
  FeatureLines(TriangleMesh const& drawn, double crease_angle);

  /// The vertices (of `drawn`) at both ends of each line of the triangles in `ranges` (ascending and apart, as
  /// VisibilitySelector gives them), in the order of the triangles; each line once. An edge between a triangle that is
  /// in them and one that is not is what it would be with all of the mesh, not a rim. Lines that are hidden are among
  /// them. `eye`: in the mesh's coordinates. Linear in the ranges' triangles.
  std::vector<Eigen::Vector2i> lines(Eigen::Vector3d const& eye, std::span<IndexRange const> ranges) const;

  std::size_t edges() const { return ends_.size(); }  ///< of the mesh

 private:
  struct Side {
    std::uint32_t triangle;
    bool against;  ///< runs along the edge in the same direction as the first one: its winding is not the neighbour's
  };
  bool shows(std::size_t edge, EyePoint const& eye) const;

  TrianglePlanes planes_;
  std::vector<Eigen::Vector2i> ends_;      ///< of each edge
  std::vector<std::uint32_t> first_side_;  ///< of each edge in sides_, and the end
  std::vector<Side> sides_;                ///< ascending triangles
  std::vector<std::uint8_t> always_;       ///< a crease or a rim
  std::vector<std::uint32_t> first_edge_;  ///< of each triangle in edges_of_, and the end
  std::vector<std::uint32_t> edges_of_;
};

}  // namespace scanview
