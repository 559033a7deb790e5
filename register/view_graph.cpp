#include "register/view_graph.h"

#include <algorithm>
#include <numeric>

#include "base/parallel.h"

namespace scanview {

std::vector<std::vector<std::size_t>> connected_parts(std::size_t count, std::vector<ViewGraphEdge> const& edges) {
  std::vector<std::size_t> root(count);
  std::iota(root.begin(), root.end(), std::size_t{0});
  auto const find = [&](std::size_t i) {
    while (root[i] != i) i = root[i];
    return i;
  };
  for (ViewGraphEdge const& edge : edges) {
    std::size_t const a = find(edge.a), b = find(edge.b);
    root[std::max(a, b)] = std::min(a, b);
  }
  std::vector<std::vector<std::size_t>> members(count), parts;
  for (std::size_t i = 0; i < count; ++i) members[find(i)].push_back(i);
  for (auto& part : members)
    if (!part.empty()) parts.push_back(std::move(part));
  std::stable_sort(parts.begin(), parts.end(), [](auto const& l, auto const& r) { return l.size() > r.size(); });
  return parts;
}

ViewGraph build_view_graph(std::vector<ViewSurface const*> const& surfaces,
                           std::vector<Eigen::Isometry3d> const& object_from_camera, double min_overlap,
                           MatchOptions const& options, Context& context) {
  std::size_t const n = surfaces.size();
  std::vector<std::vector<ViewGraphEdge>> rows(n);
  for_each_index(context, n, [&](std::size_t a) {
    for (std::size_t b = a + 1; b < n; ++b) {
      Eigen::Isometry3d const b_from_a = object_from_camera[b].inverse() * object_from_camera[a];
      PairOverlap const overlap = measure_overlap(*surfaces[a], *surfaces[b], b_from_a, options);
      if (overlap.hits >= 12 && std::max(overlap.ab, overlap.ba) >= min_overlap)
        rows[a].push_back({a, b, overlap.ab, overlap.ba});
    }
  });
  ViewGraph graph;
  for (auto const& row : rows) graph.edges.insert(graph.edges.end(), row.begin(), row.end());
  graph.parts = connected_parts(n, graph.edges);
  return graph;
}

}  // namespace scanview
