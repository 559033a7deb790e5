#include "mesh/node_panes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <vector>

namespace scanview {
namespace {

using Direction = std::array<long, 3>;

/// Equal for vertices in one direction, up to the rounding of single precision.
Direction direction_of(Eigen::Vector3f const& vertex) {
  Eigen::Vector3d const on_cube = vertex.cast<double>() / vertex.cast<double>().cwiseAbs().maxCoeff();
  Direction key;
  for (int c = 0; c < 3; ++c) key[c] = std::lround(std::ldexp(on_cube[c], 19));
  return key;
}

/// 1 / d of every vertex of the sky: given where it is framed, elsewhere relaxed between neighbours; 0: not framed.
std::vector<double> relaxed(std::vector<double> const& framed, std::vector<std::vector<int>> const& neighbours) {
  std::vector<double> value = framed;
  constexpr int kSweeps = 200;
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (std::size_t v = 0; v < value.size(); ++v) {
      if (framed[v] > 0) continue;
      double sum = 0;
      int count = 0;
      for (int const n : neighbours[v])
        if (value[n] > 0) {
          sum += value[n];
          ++count;
        }
      if (count > 0) value[v] = sum / count;
    }
  return value;
}

}  // namespace

void add_panes(NodeMesh& node, double sky_depth) {
  std::vector<char> is_sky(node.vertices.size(), 0);
  std::map<Direction, double> nearest;  // distance of what frames the sky
  for (std::size_t v = 0; v < node.vertices.size(); ++v) {
    double const distance = node.vertices[v].cast<double>().norm();
    is_sky[v] = distance >= 0.5 * sky_depth;
    if (is_sky[v] || !(distance > 0)) continue;
    auto const [entry, is_new] = nearest.try_emplace(direction_of(node.vertices[v]), distance);
    if (!is_new) entry->second = std::min(entry->second, distance);
  }
  std::vector<int> pane_of(node.vertices.size(), -1), vertex_of;
  std::vector<double> framed;
  std::vector<std::vector<int>> neighbours;
  auto const add = [&](int v) {
    if (pane_of[v] >= 0) return pane_of[v];
    pane_of[v] = int(vertex_of.size());
    vertex_of.push_back(v);
    auto const found = nearest.find(direction_of(node.vertices[v]));
    framed.push_back(found == nearest.end() ? 0 : 1 / found->second);
    neighbours.emplace_back();
    return pane_of[v];
  };
  struct Pane {
    std::size_t side;
    Eigen::Vector3i triangle;
  };
  std::vector<Pane> panes;
  for (std::size_t s = 0; s < node.sides.size(); ++s)
    for (std::size_t t = node.sides[s].first; t < node.sides[s].end; ++t) {
      Eigen::Vector3i const& from = node.triangles[t];
      if (!is_sky[from[0]] || !is_sky[from[1]] || !is_sky[from[2]]) continue;
      Eigen::Vector3i const triangle(add(from[0]), add(from[1]), add(from[2]));
      for (int i = 0; i < 3; ++i) {
        neighbours[triangle[i]].push_back(triangle[(i + 1) % 3]);
        neighbours[triangle[i]].push_back(triangle[(i + 2) % 3]);
      }
      panes.push_back({s, triangle});
    }
  std::vector<double> const inverse = relaxed(framed, neighbours);
  for (std::size_t p = 0; p < vertex_of.size(); ++p) {
    Eigen::Vector3d const direction = node.vertices[vertex_of[p]].cast<double>().normalized();
    double const distance = inverse[p] > 0 ? 1 / inverse[p] : sky_depth;
    node.panes.vertices.push_back((distance * direction).cast<float>());
  }
  for (std::size_t s = 0, p = 0; s < node.sides.size(); ++s) {
    node.sides[s].first_pane = node.panes.triangles.size();
    for (; p < panes.size() && panes[p].side == s; ++p) {
      Eigen::Vector3i const& t = panes[p].triangle;
      if (inverse[t[0]] > 0 && inverse[t[1]] > 0 && inverse[t[2]] > 0) node.panes.triangles.push_back(t);
    }
    node.sides[s].end_pane = node.panes.triangles.size();
  }
  if (node.panes.triangles.empty()) node.panes.vertices.clear();
}

}  // namespace scanview
