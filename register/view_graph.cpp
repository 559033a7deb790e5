#include "register/view_graph.h"

#include <algorithm>
#include <numeric>

#include "base/parallel.h"

namespace scanview {

namespace {

// Disjoint sets of views, each known by its smallest.
class Parts {
 public:
  explicit Parts(std::size_t count) : root_(count) { std::iota(root_.begin(), root_.end(), std::size_t{0}); }
  std::size_t find(std::size_t i) const {
    while (root_[i] != i) i = root_[i];
    return i;
  }
  /// False where they were one already.
  bool join(std::size_t i, std::size_t j) {
    std::size_t const a = find(i), b = find(j);
    root_[std::max(a, b)] = std::min(a, b);
    return a != b;
  }

 private:
  std::vector<std::size_t> root_;
};

}  // namespace

std::vector<std::vector<std::size_t>> connected_parts(std::size_t count, std::vector<ViewGraphEdge> const& edges) {
  Parts sets(count);
  for (ViewGraphEdge const& edge : edges) sets.join(edge.a, edge.b);
  std::vector<std::vector<std::size_t>> members(count), parts;
  for (std::size_t i = 0; i < count; ++i) members[sets.find(i)].push_back(i);
  for (auto& part : members)
    if (!part.empty()) parts.push_back(std::move(part));
  std::stable_sort(parts.begin(), parts.end(), [](auto const& l, auto const& r) { return l.size() > r.size(); });
  return parts;
}

ViewGraph build_view_graph(std::vector<ViewSurface const*> const& surfaces,
                           std::vector<Eigen::Isometry3d> const& object_from_camera, double min_overlap,
                           MatchOptions const& options, Context& context) {
  std::size_t const n = surfaces.size();
  struct OneWay {
    std::size_t hits = 0;
    double overlap = 0, independent = 0;  // sum over the hits
  };
  std::vector<std::vector<OneWay>> rows(n, std::vector<OneWay>(n));
  for_each_index(context, n, [&](std::size_t a) {
    std::vector<std::vector<bool>> seen(n);
    std::vector<std::size_t> views;  // that see a sample, this one among them
    for (std::size_t b = 0; b < n; ++b) {
      if (b == a) continue;
      Eigen::Isometry3d const b_from_a = object_from_camera[b].inverse() * object_from_camera[a];
      seen[b] = seen_samples(*surfaces[a], *surfaces[b], b_from_a, options);
      views.resize(seen[b].size(), 1);
      for (std::size_t k = 0; k < seen[b].size(); ++k) views[k] += seen[b][k] ? 1 : 0;
    }
    for (std::size_t b = 0; b < n; ++b) {
      OneWay& to = rows[a][b];
      for (std::size_t k = 0; k < seen[b].size(); ++k)
        if (seen[b][k]) {
          ++to.hits;
          to.independent += 2.0 / static_cast<double>(views[k]);
        }
      if (!seen[b].empty()) to.overlap = static_cast<double>(to.hits) / static_cast<double>(seen[b].size());
    }
  });
  ViewGraph graph;
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) {
      OneWay const &ab = rows[a][b], &ba = rows[b][a];
      std::size_t const hits = ab.hits + ba.hits;
      if (hits >= 12 && std::max(ab.overlap, ba.overlap) >= min_overlap)
        graph.edges.push_back(
            {a, b, ab.overlap, ba.overlap, (ab.independent + ba.independent) / static_cast<double>(hits)});
    }
  graph.parts = connected_parts(n, graph.edges);
  return graph;
}

std::vector<ViewGraphEdge> strongest_edges(std::size_t views, std::vector<ViewGraphEdge> const& edges,
                                           std::size_t count) {
  std::vector<ViewGraphEdge> sorted = edges, kept;
  std::stable_sort(sorted.begin(), sorted.end(), [](ViewGraphEdge const& l, ViewGraphEdge const& r) {
    return l.overlap_ab + l.overlap_ba > r.overlap_ab + r.overlap_ba;
  });
  Parts tree(views);
  std::vector<std::size_t> used(views, 0);
  for (ViewGraphEdge const& edge : sorted) {
    bool const joins = tree.join(edge.a, edge.b);
    if (!joins && used[edge.a] >= count && used[edge.b] >= count) continue;
    ++used[edge.a];
    ++used[edge.b];
    kept.push_back(edge);
  }
  std::sort(kept.begin(), kept.end(),
            [](ViewGraphEdge const& l, ViewGraphEdge const& r) { return std::pair(l.a, l.b) < std::pair(r.a, r.b); });
  return kept;
}

}  // namespace scanview
