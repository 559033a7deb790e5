#include "mesh/depth_triangulation.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

#include "mesh/surface_links.h"

namespace scanview {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_2 exact(Eigen::Vector2d const& p) { return {p.x(), p.y()}; }

/// Whether three points turn from x to y by more than rounding can undo: twice the area, in square pixels, of a picture
/// of up to 30000 pixels.
bool turns(Eigen::Vector2d const& a, Eigen::Vector2d const& b, Eigen::Vector2d const& c) {
  constexpr double kLeastTurn = 1e-6;
  return (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x()) > kLeastTurn;
}

}  // namespace

int DepthTriangulation::add_vertex(Eigen::Vector2d const& position, double depth, bool on_border) {
  vertices_.push_back({position, depth, on_border, false, -1});
  return int(vertices_.size()) - 1;
}

int DepthTriangulation::add_triangle(int a, int b, int c) {
  int const t = int(triangles_.size());
  triangles_.push_back({{a, b, c}, {-1, -1, -1}});
  for (int const v : {a, b, c}) vertices_[v].triangle = t;
  ++count_;
  return t;
}

void DepthTriangulation::connect() {
  std::unordered_map<std::uint64_t, std::pair<int, int>> open;
  open.reserve(3 * triangles_.size());
  for (int t = 0; t < int(triangles_.size()); ++t)
    for (int i = 0; i < 3; ++i) {
      auto const [low, high] = std::minmax(triangles_[t].vertex[(i + 1) % 3], triangles_[t].vertex[(i + 2) % 3]);
      auto const [it, is_new] = open.try_emplace(std::uint64_t(low) << 32 | std::uint32_t(high), t, i);
      if (is_new) continue;
      triangles_[t].next[i] = it->second.first;
      triangles_[it->second.first].next[it->second.second] = t;
      open.erase(it);
    }
}

int DepthTriangulation::count_vertices() const {
  return int(std::count_if(vertices_.begin(), vertices_.end(), [](Vertex const& v) { return v.triangle >= 0; }));
}

void DepthTriangulation::order_by_place() {
  constexpr double kSquare = 64;  // pixels
  struct Place {
    int row, column, triangle;
    auto operator<=>(Place const&) const = default;
  };
  std::vector<Place> order;
  for (int t = 0; t < int(triangles_.size()); ++t) {
    if (!alive(t)) continue;
    DepthTriangle const s = shape(t);
    Eigen::Vector2d const middle = (s.corner[0] + s.corner[1] + s.corner[2]) / (3 * kSquare);
    order.push_back({int(std::floor(middle.y())), int(std::floor(middle.x())), t});
  }
  std::sort(order.begin(), order.end());
  std::vector<int> new_triangle(triangles_.size(), -1), new_vertex(vertices_.size(), -1);
  for (std::size_t k = 0; k < order.size(); ++k) new_triangle[order[k].triangle] = int(k);
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  for (Place const& place : order) {
    Triangle triangle = triangles_[place.triangle];
    for (int i = 0; i < 3; ++i) {
      int& vertex = new_vertex[triangle.vertex[i]];
      if (vertex < 0) {
        vertex = int(vertices.size());
        vertices.push_back(vertices_[triangle.vertex[i]]);
        vertices.back().triangle = new_triangle[vertices.back().triangle];
      }
      triangle.vertex[i] = vertex;
      if (triangle.next[i] >= 0) triangle.next[i] = new_triangle[triangle.next[i]];
    }
    triangles.push_back(triangle);
  }
  vertices_ = std::move(vertices);
  triangles_ = std::move(triangles);
}

DepthTriangle DepthTriangulation::shape(int t) const {
  DepthTriangle result;
  for (int i = 0; i < 3; ++i) {
    Vertex const& v = vertices_[triangles_[t].vertex[i]];
    result.corner[i] = v.position;
    result.depth[i] = v.depth;
  }
  return result;
}

int DepthTriangulation::corner_of(int t, int v) const {
  auto const& corners = triangles_[t].vertex;
  return int(std::find(corners.begin(), corners.end(), v) - corners.begin());
}

int DepthTriangulation::opposite_of(int t, int to) const {
  auto const& next = triangles_[t].next;
  return int(std::find(next.begin(), next.end(), to) - next.begin());
}

void DepthTriangulation::triangles_around(int v, std::vector<int>& out) const {
  out.clear();
  int const start = vertices_[v].triangle;
  int t = start;
  // Back to where the border begins, or all around.
  while (true) {
    int const before = triangles_[t].next[(corner_of(t, v) + 2) % 3];
    if (before < 0 || before == start) break;
    t = before;
  }
  int const first = vertices_[v].on_border ? t : start;
  t = first;
  do {
    out.push_back(t);
    t = triangles_[t].next[(corner_of(t, v) + 1) % 3];
  } while (t >= 0 && t != first);
}

void DepthTriangulation::relink(int t, int from, int to) {
  if (t >= 0) triangles_[t].next[opposite_of(t, from)] = to;
}

std::optional<int> DepthTriangulation::insert(int t, Eigen::Vector2d const& position, double depth) {
  for (int i = 0; i < 3; ++i) {
    Eigen::Vector2d const b = vertices_[triangles_[t].vertex[(i + 1) % 3]].position;
    Eigen::Vector2d const c = vertices_[triangles_[t].vertex[(i + 2) % 3]].position;
    if (position == b) return std::nullopt;
    if (turns(b, c, position)) continue;
    if (position == c) return std::nullopt;
    return split_edge(t, i, position, depth);
  }
  int const p = add_vertex(position, depth, false);
  auto const [a, b, c] = triangles_[t].vertex;
  auto const [na, nb, nc] = triangles_[t].next;
  int const t1 = int(triangles_.size()), t2 = t1 + 1;
  triangles_[t] = {{p, b, c}, {na, t1, t2}};
  triangles_.push_back({{p, c, a}, {nb, t2, t}});
  triangles_.push_back({{p, a, b}, {nc, t, t1}});
  relink(nb, t, t1);
  relink(nc, t, t2);
  vertices_[p].triangle = vertices_[b].triangle = vertices_[c].triangle = t;
  vertices_[a].triangle = t1;
  count_ += 2;
  return p;
}

int DepthTriangulation::split_edge(int t, int i, Eigen::Vector2d const& position, double depth) {
  int const a = triangles_[t].vertex[i], b = triangles_[t].vertex[(i + 1) % 3], c = triangles_[t].vertex[(i + 2) % 3];
  int const n = triangles_[t].next[i], nb = triangles_[t].next[(i + 1) % 3], nc = triangles_[t].next[(i + 2) % 3];
  int const p = add_vertex(position, depth, n < 0);
  int const t1 = int(triangles_.size()), n1 = n < 0 ? -1 : t1 + 1;
  triangles_[t] = {{a, b, p}, {n1, t1, nc}};
  triangles_.push_back({{a, p, c}, {n, nb, t}});
  relink(nb, t, t1);
  if (n >= 0) {
    int const j = opposite_of(n, t);
    int const d = triangles_[n].vertex[j];
    int const across_b = triangles_[n].next[(j + 2) % 3], across_c = triangles_[n].next[(j + 1) % 3];
    // The neighbour's corners are d, then c, then b: its edge (b, d) lies opposite c, (d, c) opposite b.
    triangles_[n] = {{d, c, p}, {t1, n1, across_b}};
    triangles_.push_back({{d, p, b}, {t, across_c, n}});
    relink(across_c, n, n1);
    vertices_[d].triangle = n;
    ++count_;
  }
  ++count_;
  vertices_[p].triangle = vertices_[a].triangle = vertices_[b].triangle = t;
  vertices_[c].triangle = t1;
  return p;
}

bool DepthTriangulation::can_flip(int t, int i) const {
  int const n = triangles_[t].next[i];
  if (n < 0) return false;
  Eigen::Vector2d const a = vertices_[triangles_[t].vertex[i]].position;
  Eigen::Vector2d const b = vertices_[triangles_[t].vertex[(i + 1) % 3]].position;
  Eigen::Vector2d const c = vertices_[triangles_[t].vertex[(i + 2) % 3]].position;
  Eigen::Vector2d const d = vertices_[triangles_[n].vertex[opposite_of(n, t)]].position;
  return turns(a, b, d) && turns(a, d, c);
}

void DepthTriangulation::flip(int t, int i) {
  int const a = triangles_[t].vertex[i], b = triangles_[t].vertex[(i + 1) % 3], c = triangles_[t].vertex[(i + 2) % 3];
  int const n = triangles_[t].next[i], nb = triangles_[t].next[(i + 1) % 3], nc = triangles_[t].next[(i + 2) % 3];
  int const j = opposite_of(n, t);
  int const d = triangles_[n].vertex[j];
  int const across_c = triangles_[n].next[(j + 1) % 3], across_b = triangles_[n].next[(j + 2) % 3];
  triangles_[t] = {{a, b, d}, {across_c, n, nc}};
  triangles_[n] = {{a, d, c}, {across_b, nb, t}};
  relink(across_c, n, t);
  relink(nb, t, n);
  vertices_[a].triangle = vertices_[b].triangle = vertices_[d].triangle = t;
  vertices_[c].triangle = n;
}

bool DepthTriangulation::breaks_delaunay(int t, int i) const {
  int const n = triangles_[t].next[i];
  if (n < 0) return false;
  auto const& v = triangles_[t].vertex;
  Eigen::Vector2d const d = vertices_[triangles_[n].vertex[opposite_of(n, t)]].position;
  return CGAL::side_of_oriented_circle(exact(vertices_[v[0]].position), exact(vertices_[v[1]].position),
                                       exact(vertices_[v[2]].position), exact(d)) == CGAL::ON_POSITIVE_SIDE;
}

void DepthTriangulation::restore_delaunay(int v) {
  std::vector<int> open;
  triangles_around(v, open);
  while (!open.empty()) {
    int const t = open.back(), i = corner_of(t, v);
    if (!breaks_delaunay(t, i) || !can_flip(t, i)) {
      open.pop_back();
      continue;
    }
    int const n = triangles_[t].next[i];
    flip(t, i);
    open.push_back(n);
  }
}

bool DepthTriangulation::can_move(int v, Eigen::Vector2d const& position) const {
  if (vertices_[v].on_border) return false;
  std::vector<int> around;
  triangles_around(v, around);
  return std::all_of(around.begin(), around.end(), [&](int t) {
    int const i = corner_of(t, v);
    return turns(position, vertices_[triangles_[t].vertex[(i + 1) % 3]].position,
                 vertices_[triangles_[t].vertex[(i + 2) % 3]].position);
  });
}

void DepthTriangulation::move(int v, Eigen::Vector2d const& position, double depth) {
  vertices_[v].position = position;
  vertices_[v].depth = depth;
}

bool DepthTriangulation::can_collapse(int v, int u) const {
  if (vertices_[v].on_border) return false;
  std::vector<int> around;
  triangles_around(v, around);
  if (around.size() <= 3) return false;  // two of its neighbours would meet twice
  Eigen::Vector2d const to = vertices_[u].position;
  int beside = 0;
  for (int const t : around) {
    auto const& corners = triangles_[t].vertex;
    if (std::find(corners.begin(), corners.end(), u) != corners.end()) {
      ++beside;
      continue;
    }
    int const i = corner_of(t, v);
    int const b = corners[(i + 1) % 3], c = corners[(i + 2) % 3];
    if (!turns(to, vertices_[b].position, vertices_[c].position)) return false;
  }
  return beside == 2;
}

void DepthTriangulation::collapse(int v, int u) {
  std::vector<int> around;
  triangles_around(v, around);
  for (int const t : around) {
    int const i = corner_of(t, v), k = corner_of(t, u);
    if (k == 3) {
      triangles_[t].vertex[i] = u;
      continue;
    }
    int const other = triangles_[t].vertex[3 - i - k];
    int const outside = triangles_[t].next[i], inside = triangles_[t].next[k];
    // What lies beyond edge (u, other) meets what lies beyond edge (v, other).
    relink(outside, t, inside);
    relink(inside, t, outside);
    vertices_[u].triangle = vertices_[other].triangle = inside;
    triangles_[t].vertex = {-1, -1, -1};
    --count_;
  }
  vertices_[v].triangle = -1;
}

void DepthTriangulation::round_to_single(Camera const& camera) {
  for (Vertex& v : vertices_) {
    if (v.triangle < 0) continue;
    Eigen::Vector3d const p =
        camera.unproject(v.position.x(), v.position.y(), linear_depth(camera, v.depth)).cast<float>().cast<double>();
    v.position = camera.project(p);
    v.depth = linear_depth(camera, p.z());
  }
}

TriangleMesh DepthTriangulation::to_mesh(Camera const& camera) const {
  TriangleMesh mesh;
  std::vector<int> index(vertices_.size(), -1);
  for (Triangle const& triangle : triangles_) {
    if (triangle.vertex[0] < 0) continue;
    Eigen::Vector3i corners;
    for (int i = 0; i < 3; ++i) {
      int& at = index[triangle.vertex[i]];
      if (at < 0) {
        at = int(mesh.vertices.size());
        Vertex const& v = vertices_[triangle.vertex[i]];
        mesh.vertices.push_back(
            camera.unproject(v.position.x(), v.position.y(), linear_depth(camera, v.depth)).cast<float>());
      }
      corners[i] = at;
    }
    // From x (right) to y (down) faces away from the camera: the other way round.
    mesh.triangles.emplace_back(corners[0], corners[2], corners[1]);
  }
  return mesh;
}

}  // namespace scanview
