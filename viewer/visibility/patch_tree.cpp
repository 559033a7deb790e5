#include "viewer/visibility/patch_tree.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <queue>
#include <stdexcept>
#include <tuple>

namespace scanview {
namespace {

using Box = Eigen::AlignedBox3f;
using Neighbors = std::vector<std::uint32_t>;  // ascending, each once

struct Edge {
  std::int32_t low, high;
  std::uint32_t polygon;
  bool operator<(Edge const& other) const {
    return std::tie(low, high, polygon) < std::tie(other.low, other.high, other.polygon);
  }
};

/// Smallest first; of equal areas the earlier.
struct Candidate {
  double area;
  std::uint32_t patch;
  bool operator<(Candidate const& other) const { return std::tie(area, patch) > std::tie(other.area, other.patch); }
};

}  // namespace

std::vector<std::vector<std::uint32_t>> polygon_neighbors(TriangleMesh const& mesh,
                                                          std::vector<std::int32_t> const& polygons,
                                                          std::size_t count) {
  std::vector<Edge> edges;
  edges.reserve(3 * mesh.triangles.size());
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    auto const polygon = static_cast<std::uint32_t>(polygons.empty() ? i : static_cast<std::size_t>(polygons[i]));
    for (int k = 0; k < 3; ++k) {
      auto const [low, high] = std::minmax(mesh.triangles[i][k], mesh.triangles[i][(k + 1) % 3]);
      if (low != high) edges.push_back({low, high, polygon});
    }
  }
  std::sort(edges.begin(), edges.end());
  std::vector<Neighbors> neighbors(count);
  for (std::size_t begin = 0, end = 0; begin < edges.size(); begin = end) {
    while (end < edges.size() && edges[end].low == edges[begin].low && edges[end].high == edges[begin].high) ++end;
    // An edge of many polygons links each with the next: enough to fuse them all, without their square.
    for (std::size_t i = begin + 1; i < end; ++i) {
      if (edges[i].polygon == edges[i - 1].polygon) continue;
      neighbors[edges[i].polygon].push_back(edges[i - 1].polygon);
      neighbors[edges[i - 1].polygon].push_back(edges[i].polygon);
    }
  }
  for (auto& list : neighbors) {
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
  }
  return neighbors;
}

PatchTree::PatchTree(TriangleMesh const& mesh, std::vector<std::int32_t> const& polygons) {
  if (!polygons.empty() && polygons.size() != mesh.triangles.size())
    throw std::logic_error("PatchTree: a polygon for each triangle");
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    if (polygons.empty() || i == 0 || polygons[i] != polygons[i - 1])
      first_triangle_.push_back(static_cast<std::uint32_t>(i));
  }
  leaves_ = first_triangle_.size();
  first_triangle_.push_back(static_cast<std::uint32_t>(mesh.triangles.size()));

  std::vector<Neighbors> neighbors = polygon_neighbors(mesh, polygons, leaves_);
  std::vector<double> area(leaves_, 0.0);
  std::vector<Box> box(leaves_);
  for (std::size_t leaf = 0; leaf < leaves_; ++leaf) {
    for (std::size_t i = first_triangle_[leaf]; i < first_triangle_[leaf + 1]; ++i) {
      auto const corner = [&](int k) { return mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][k])]; };
      Eigen::Vector3d const a = corner(0).cast<double>();
      area[leaf] += 0.5 * (corner(1).cast<double>() - a).cross(corner(2).cast<double>() - a).norm();
      for (int k = 0; k < 3; ++k) box[leaf].extend(corner(k));
    }
  }
  std::size_t const most = 2 * leaves_;
  neighbors.reserve(most);
  area.reserve(most);
  box.reserve(most);
  std::vector<std::uint32_t> fused_into(leaves_);  // itself while it is there
  for (std::size_t i = 0; i < leaves_; ++i) fused_into[i] = static_cast<std::uint32_t>(i);
  fused_into.reserve(most);
  auto const alive = [&](std::uint32_t patch) { return fused_into[patch] == patch; };
  auto const present = [&](std::uint32_t patch) {
    while (!alive(patch)) patch = fused_into[patch] = fused_into[fused_into[patch]];
    return patch;
  };

  std::vector<Candidate> start;
  start.reserve(leaves_);
  for (std::size_t i = 0; i < leaves_; ++i) start.push_back({area[i], static_cast<std::uint32_t>(i)});
  std::priority_queue<Candidate> smallest(std::less<Candidate>(), std::move(start));
  while (!smallest.empty()) {
    std::uint32_t const patch = smallest.top().patch;
    smallest.pop();
    if (!alive(patch)) continue;
    // Lists name patches as they were; brought up to date where they are read.
    Neighbors& list = neighbors[patch];
    for (auto& neighbor : list) neighbor = present(neighbor);
    std::sort(list.begin(), list.end());
    list.erase(std::unique(list.begin(), list.end()), list.end());
    std::erase(list, patch);
    if (list.empty()) continue;
    std::uint32_t best = list.front();
    float least = std::numeric_limits<float>::infinity();
    for (std::uint32_t const neighbor : list) {
      float const diagonal = box[patch].merged(box[neighbor]).diagonal().squaredNorm();
      if (diagonal < least) {
        least = diagonal;
        best = neighbor;
      }
    }
    auto const fused = static_cast<std::uint32_t>(fused_into.size());
    fused_into[patch] = fused_into[best] = fused;
    fused_into.push_back(fused);
    fusions_.push_back({std::min(patch, best), std::max(patch, best)});
    area.push_back(area[patch] + area[best]);
    box.push_back(box[patch].merged(box[best]));
    Neighbors joined = std::move(neighbors[patch]);
    joined.insert(joined.end(), neighbors[best].begin(), neighbors[best].end());
    Neighbors().swap(neighbors[best]);
    neighbors.push_back(std::move(joined));
    smallest.push({area.back(), fused});
  }
}

PatchHierarchy PatchTree::hierarchy(std::size_t count) const {
  std::size_t const steps = count >= leaves_ ? 0 : std::min(fusions_.size(), leaves_ - count);
  // Whole parts are walked by the whole tree, so that what is fused next stands side by side.
  std::vector<bool> is_root(leaves_ + fusions_.size(), true);
  for (auto const& [first, second] : fusions_) is_root[first] = is_root[second] = false;
  PatchHierarchy result;
  Patches& patches = result.fine;
  std::vector<std::uint32_t> node_of(is_root.size());  // of each node of the tree that is a patch or fuses patches
  patches.triangles.reserve(first_triangle_.back());
  std::vector<std::uint32_t> stack;
  for (std::size_t root = 0; root < is_root.size(); ++root) {
    if (!is_root[root]) continue;
    stack.push_back(static_cast<std::uint32_t>(root));
    std::size_t pending = 0;  // entries of the stack that belong to the patch begun last
    while (!stack.empty()) {
      std::uint32_t const node = stack.back();
      stack.pop_back();
      if (pending == 0 && node < leaves_ + steps) {
        node_of[node] = static_cast<std::uint32_t>(patches.begins.size());
        patches.begins.push_back(static_cast<std::uint32_t>(patches.triangles.size()));
        pending = 1;
      }
      if (pending > 0) --pending;
      if (node < leaves_) {
        for (std::uint32_t i = first_triangle_[node]; i < first_triangle_[node + 1]; ++i)
          patches.triangles.push_back(i);
        continue;
      }
      PatchHierarchy::Fusion const& fusion = fusions_[node - leaves_];
      stack.push_back(fusion.second);
      stack.push_back(fusion.first);
      if (node < leaves_ + steps) pending += 2;
    }
  }
  patches.begins.push_back(static_cast<std::uint32_t>(patches.triangles.size()));
  for (std::size_t j = steps; j < fusions_.size(); ++j) {
    node_of[leaves_ + j] = static_cast<std::uint32_t>(patches.count() + result.fusions.size());
    result.fusions.push_back({node_of[fusions_[j].first], node_of[fusions_[j].second]});
  }
  return result;
}

}  // namespace scanview
