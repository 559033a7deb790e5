#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "base/context.h"
#include "register/pair_form.h"

namespace scanview {

/// Two views that see a common surface.
struct ViewGraphEdge {
  std::size_t a = 0, b = 0;               ///< a < b
  double overlap_ab = 0, overlap_ba = 0;  ///< share of a's depths that b sees, and the other way
  /// Of what the pair says, the share that other pairs do not say as well: mean over the common surface of 2/n, where n
  /// views see it. Their n(n - 1)/2 pairs compare only n noisy surfaces (the sum of all squared differences is n times
  /// that from the mean).
  double independent = 1;
};

/// Which views overlap at given poses. Nothing is assumed about where the cameras stand.
struct ViewGraph {
  std::vector<ViewGraphEdge> edges;             ///< ordered by (a, b)
  std::vector<std::vector<std::size_t>> parts;  ///< connected parts, largest first, views in order
};

/// Projects the samples of every view into every other. An edge needs `min_overlap` of the smaller view's samples.
/// Cost: views squared times samples.
ViewGraph build_view_graph(std::vector<ViewSurface const*> const& surfaces,
                           std::vector<Eigen::Isometry3d> const& object_from_camera, double min_overlap,
                           MatchOptions const& options, Context& context);

/// Connected parts of `count` views under these edges, largest first, then by their first view.
std::vector<std::vector<std::size_t>> connected_parts(std::size_t count, std::vector<ViewGraphEdge> const& edges);
/// For every view its `count` edges of largest overlap, and those that a spanning tree of all needs besides (Kruskal,
/// largest first): as connected as all of them, at a cost that grows with the views, not with their square. Ordered by
/// (a, b).
std::vector<ViewGraphEdge> strongest_edges(std::size_t views, std::vector<ViewGraphEdge> const& edges,
                                           std::size_t count);

}  // namespace scanview
