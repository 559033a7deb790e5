#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mesh/triangle_mesh.h"

namespace scanview {

/// For each of `count` polygons those that share an edge with it, ascending. polygons: of each triangle, ascending;
/// empty: each its own. An edge of more than two links each polygon with the next, so that all hang together.
std::vector<std::vector<std::uint32_t>> polygon_neighbors(TriangleMesh const& mesh,
                                                          std::vector<std::int32_t> const& polygons, std::size_t count);

/// The polygons of a model, cut into patches.
struct Patches {
  /// Triangles in the order in which they are drawn: those of a patch follow each other, those of neighbouring patches
  /// mostly too.
  std::vector<std::uint32_t> triangles;
  std::vector<std::uint32_t> begins;  ///< of each patch in `triangles`; and the end

  std::size_t count() const { return begins.size() - 1; }
};

/// How fine patches fuse into coarser ones. Node p < fine.count() is fine patch p; node fine.count() + j is fusion j of
/// two earlier nodes. A node's fine patches follow each other.
struct PatchHierarchy {
  struct Fusion {
    std::uint32_t first, second;
  };
  Patches fine;
  std::vector<Fusion> fusions;
};

/// Polygons fused into patches, and these into larger ones, until nothing neighbours anything (Meruvia 2002, section
/// 3.1): in each step the smallest patch by area joins the neighbour with which its bounding box has the least
/// diagonal. Neighbours share an edge, also one of three or more polygons; parts that share none never fuse. Ties are
/// broken by the polygons' order: the same model has the same tree. n log n.
class PatchTree {
 public:
  /// polygons: the polygon of each triangle, ascending from 0; empty: each triangle its own. A polygon stays whole.
  explicit PatchTree(TriangleMesh const& mesh, std::vector<std::int32_t> const& polygons = {});
  std::size_t polygon_count() const { return leaves_; }
  /// Parts of the model without a common edge: the least number of patches.
  std::size_t part_count() const { return leaves_ - fusions_.size(); }
  /// At most `count` patches, or part_count() where that is more.
  Patches cut(std::size_t count) const { return hierarchy(count).fine; }
  /// These patches, and how they fuse on.
  PatchHierarchy hierarchy(std::size_t count) const;

 private:
  std::size_t leaves_ = 0;
  std::vector<PatchHierarchy::Fusion> fusions_;  ///< of polygons, or polygon_count() + the earlier fusion
  std::vector<std::uint32_t> first_triangle_;    ///< of each polygon, and the end
};

}  // namespace scanview
