#include "mesh/inward_winding.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>

#include "mesh/equal_vertices.h"

namespace scanview {
namespace {

using Triangles = std::vector<Eigen::Vector3i>;

constexpr double kRounding = 1e-6;  ///< of a closed surface's volume: that of a doubled sheet is zero
constexpr double kClear = 0.25;     ///< of an open one's

int root_of(std::vector<int>& parent, int at) {
  while (parent[at] != at) at = parent[at] = parent[parent[at]];
  return at;
}

struct HalfEdge {
  int to;        ///< the larger one of its two vertices
  int triangle;  ///< that runs along it
  int way;       ///< 1: from the smaller to the larger
};

/// For every triangle whether its part is closed. Triangles with a doubled corner have no side: they are never closed.
std::vector<std::uint8_t> in_closed_part(Triangles const& triangles, std::size_t vertex_count) {
  auto const has_area = [](Eigen::Vector3i const& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; };
  std::vector<std::size_t> begin(vertex_count + 1, 0);
  for (Eigen::Vector3i const& t : triangles)
    for (int i = 0; i < 3 && has_area(t); ++i) ++begin[std::min(t[i], t[(i + 1) % 3]) + 1];
  std::partial_sum(begin.begin(), begin.end(), begin.begin());
  std::vector<HalfEdge> edges(begin.back());
  std::vector<std::size_t> end(begin.begin(), begin.end() - 1);
  for (std::size_t k = 0; k < triangles.size(); ++k) {
    Eigen::Vector3i const& t = triangles[k];
    for (int i = 0; i < 3 && has_area(t); ++i) {
      int const a = t[i], b = t[(i + 1) % 3];
      edges[end[std::min(a, b)]++] = {std::max(a, b), int(k), a < b ? 1 : -1};
    }
  }
  std::vector<int> parent(triangles.size());
  std::iota(parent.begin(), parent.end(), 0);
  std::vector<int> at_borders;
  for (std::size_t v = 0; v < vertex_count; ++v) {
    auto const last = edges.begin() + std::ptrdiff_t(end[v]);
    std::sort(edges.begin() + std::ptrdiff_t(begin[v]), last, [](auto const& l, auto const& r) { return l.to < r.to; });
    for (auto first = edges.begin() + std::ptrdiff_t(begin[v]); first != last;) {
      int balance = 0;
      auto edge = first;
      for (; edge != last && edge->to == first->to; ++edge) {
        balance += edge->way;
        int const ours = root_of(parent, first->triangle), other = root_of(parent, edge->triangle);
        parent[std::max(ours, other)] = std::min(ours, other);
      }
      if (balance != 0) at_borders.push_back(first->triangle);
      first = edge;
    }
  }
  std::vector<std::uint8_t> closed(triangles.size(), 1), result(triangles.size());
  for (int const triangle : at_borders) closed[root_of(parent, triangle)] = 0;
  for (std::size_t k = 0; k < triangles.size(); ++k)
    result[k] = closed[root_of(parent, int(k))] && has_area(triangles[k]);
  return result;
}

/// Sums over triangles seen from one point: three times the signed volume between, and that if all faced straight away.
struct Outflow {
  double volume = 0, most = 0, area = 0;
  void add(Eigen::Vector3d const& middle, Eigen::Vector3d const& normal) {
    volume += middle.dot(normal);
    most += middle.norm() * normal.norm();
    area += normal.norm();
  }
};

}  // namespace

bool is_wound_inwards(TriangleMesh const& mesh) {
  std::vector<int> const first = first_of_equals(mesh.vertices);
  Triangles joined = mesh.triangles;
  for (Eigen::Vector3i& triangle : joined)
    for (int& corner : triangle) corner = first[corner];
  std::vector<std::uint8_t> const is_closed = in_closed_part(joined, mesh.vertices.size());

  auto const visit = [&](auto const& use) {
    for (std::size_t k = 0; k < joined.size(); ++k) {
      Eigen::Vector3d const a = mesh.vertices[joined[k][0]].cast<double>();
      Eigen::Vector3d const b = mesh.vertices[joined[k][1]].cast<double>();
      Eigen::Vector3d const c = mesh.vertices[joined[k][2]].cast<double>();
      use(k, Eigen::Vector3d((a + b + c) / 3), Eigen::Vector3d((b - a).cross(c - a) / 2));
    }
  };
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  double area = 0;
  visit([&](std::size_t, Eigen::Vector3d const& middle, Eigen::Vector3d const& normal) {
    centroid += middle * normal.norm();
    area += normal.norm();
  });
  if (!(area > 0)) return false;
  centroid /= area;
  Outflow all, closed;
  visit([&](std::size_t k, Eigen::Vector3d const& middle, Eigen::Vector3d const& normal) {
    all.add(middle - centroid, normal);
    if (is_closed[k]) closed.add(middle - centroid, normal);
  });
  if (2 * closed.area >= all.area && std::abs(closed.volume) > kRounding * closed.most) return closed.volume < 0;
  return all.volume < -kClear * all.most;
}

TriangleMesh turned(TriangleMesh mesh) {
  for (Eigen::Vector3i& triangle : mesh.triangles) std::swap(triangle[1], triangle[2]);
  return mesh;
}

}  // namespace scanview
