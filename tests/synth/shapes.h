#pragma once
#include <array>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "mesh/triangle_mesh.h"

namespace scanview {

/// A regular icosahedron, each triangle split into four `levels` times, its vertices on the sphere; outward.
inline TriangleMesh make_icosphere(Eigen::Vector3d const& center, double radius, int levels) {
  double const g = 0.5 * (1 + std::sqrt(5.0));
  std::vector<Eigen::Vector3d> points = {{-1, g, 0},  {1, g, 0},  {-1, -g, 0}, {1, -g, 0}, {0, -1, g},  {0, 1, g},
                                         {0, -1, -g}, {0, 1, -g}, {g, 0, -1},  {g, 0, 1},  {-g, 0, -1}, {-g, 0, 1}};
  std::vector<Eigen::Vector3i> triangles = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                                            {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                                            {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                                            {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middle_of;
    auto const middle = [&](int a, int b) {
      auto const [at, fresh] = middle_of.try_emplace(std::minmax(a, b), static_cast<int>(points.size()));
      if (fresh) points.push_back(points[a].normalized() + points[b].normalized());
      return at->second;
    };
    std::vector<Eigen::Vector3i> finer;
    for (auto const& t : triangles) {
      int const a = middle(t[0], t[1]), b = middle(t[1], t[2]), c = middle(t[2], t[0]);
      finer.insert(finer.end(), {{t[0], a, c}, {t[1], b, a}, {t[2], c, b}, {a, b, c}});
    }
    triangles = std::move(finer);
  }
  TriangleMesh mesh;
  mesh.triangles = std::move(triangles);
  for (auto const& p : points) mesh.vertices.push_back((center + radius * p.normalized()).cast<float>());
  return mesh;
}

/// A cube of side 2 about the origin with shared corners, outward.
inline TriangleMesh make_cube() {
  TriangleMesh mesh;
  for (int c = 0; c < 8; ++c) mesh.vertices.emplace_back(c & 1 ? 1 : -1, c & 2 ? 1 : -1, c & 4 ? 1 : -1);
  for (auto const& q :
       {Eigen::Vector4i(0, 2, 3, 1), {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}}) {
    mesh.triangles.emplace_back(q[0], q[1], q[2]);
    mesh.triangles.emplace_back(q[0], q[2], q[3]);
  }
  return mesh;
}

/// Vertices of equal position joined.
inline TriangleMesh welded(TriangleMesh const& mesh) {
  TriangleMesh result;
  std::map<std::array<float, 3>, int> known;
  std::vector<int> now(mesh.vertices.size());
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    Eigen::Vector3f const p = mesh.vertices[i] + Eigen::Vector3f::Zero();  // no -0
    auto const [at, is_new] = known.try_emplace({p.x(), p.y(), p.z()}, static_cast<int>(result.vertices.size()));
    if (is_new) result.vertices.push_back(p);
    now[i] = at->second;
  }
  for (auto const& t : mesh.triangles) result.triangles.emplace_back(now[t[0]], now[t[1]], now[t[2]]);
  return result;
}

/// True where every edge is run through as often one way as the other.
inline bool is_closed(TriangleMesh const& mesh) {
  std::map<std::pair<int, int>, int> balance;
  for (auto const& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      int const a = t[i], b = t[(i + 1) % 3];
      balance[std::minmax(a, b)] += a < b ? 1 : -1;
    }
  for (auto const& edge : balance)
    if (edge.second != 0) return false;
  return true;
}

/// Positive for an outward closed mesh.
inline double signed_volume(TriangleMesh const& mesh) {
  double sum = 0;
  for (auto const& t : mesh.triangles)
    sum += mesh.vertices[t[0]].cast<double>().dot(
               mesh.vertices[t[1]].cast<double>().cross(mesh.vertices[t[2]].cast<double>())) /
           6;
  return sum;
}

}  // namespace scanview
