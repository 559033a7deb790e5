#include "mesh/greedy_insertion.h"

#include <cmath>
#include <cstdint>
#include <queue>
#include <unordered_set>
#include <vector>

#include "mesh/local_surface.h"

namespace scanview {
namespace {

struct Candidate {
  float error;  ///< in tolerances
  int triangle;
  std::uint32_t stamp;
  TriangleError found;
  bool operator<(Candidate const& other) const {
    return error != other.error ? error < other.error : triangle > other.triangle;
  }
};

class GreedyInsertion {
 public:
  GreedyInsertion(DepthTriangulation& triangulation, DepthField const& field, VertexMaker const& maker, double limit,
                  int max_triangles, Context& context)
      : triangulation_(triangulation),
        field_(field),
        maker_(maker),
        limit_(limit),
        max_triangles_(max_triangles),
        context_(context) {}

  void run() {
    for (int t = 0; t < int(triangulation_.triangles().size()); ++t)
      if (triangulation_.alive(t)) look_at(t);
    for (std::size_t step = 0; !queue_.empty(); ++step) {
      if (step % 1024 == 0) context_.check_cancelled();
      Candidate const worst = queue_.top();
      queue_.pop();
      if (stamps_[worst.triangle] != worst.stamp) continue;
      if (full()) return;
      DepthTriangle const shape = triangulation_.shape(worst.triangle);
      int const x = find_worst_column(field_, shape, worst.found);
      insert(worst.triangle, x, worst.found.row);
    }
  }

 private:
  bool full() const { return max_triangles_ > 0 && triangulation_.count() + 2 > max_triangles_; }

  void insert(int t, int x, int y) {
    Eigen::Vector2d const point(x, y);
    int const on_border = maker_.split_border(triangulation_, t, point);
    if (on_border >= 0) {
      settle(on_border);
      return;
    }
    auto const added = triangulation_.insert(t, point, maker_.depth_at(x, y));
    if (!added) {
      pin(t, point, maker_.depth_at(x, y));
      return;
    }
    settle(*added);
    while (split_border_around(*added)) {
    }
  }

  /// Takes a vertex that was fitted away from its pixel back to it, once.
  void pin(int t, Eigen::Vector2d const& point, double depth) {
    for (int const v : triangulation_.triangle(t).vertex) {
      if (triangulation_.vertex(v).position != point || !pinned_.insert(v).second) continue;
      triangulation_.set_depth(v, depth);
      triangulation_.triangles_around(v, around_);
      for (int const around : around_) look_at(around);
      return;
    }
  }

  bool split_border_around(int v) {
    if (full()) return false;
    Eigen::Vector2d const point = triangulation_.vertex(v).position;
    triangulation_.triangles_around(v, around_);
    for (int const t : around_) {
      int const added = maker_.split_border(triangulation_, t, point);
      if (added < 0) continue;
      settle(added);
      return true;
    }
    return false;
  }

  /// All triangles that an insertion changes have the new vertex.
  void settle(int v) {
    triangulation_.restore_delaunay(v);
    triangulation_.triangles_around(v, around_);
    for (int const t : around_) look_at(t);
  }

  void look_at(int t) {
    if (std::size_t(t) >= stamps_.size()) stamps_.resize(t + 64, 0);
    TriangleError const error = scan_error(field_, triangulation_.shape(t));
    stamps_[t] = ++stamp_;
    if (error.worst > limit_) queue_.push({error.worst, t, stamp_, error});
  }

  DepthTriangulation& triangulation_;
  DepthField const& field_;
  VertexMaker const& maker_;
  double limit_;
  int max_triangles_;
  Context& context_;
  std::priority_queue<Candidate> queue_;
  std::vector<std::uint32_t> stamps_;  ///< of the latest look at a triangle
  std::uint32_t stamp_ = 0;
  std::vector<int> around_;
  std::unordered_set<int> pinned_;
};

}  // namespace

double VertexMaker::depth_at(int x, int y) const {
  if (!smooth_) return linear_depth(image_.camera, image_.depth(y, x));
  return fit_local_surface(image_, links_, x, y, tolerance_(y, x)).depth;
}

int VertexMaker::split_border(DepthTriangulation& triangulation, int t, Eigen::Vector2d const& point) const {
  if (!smooth_) return -1;
  constexpr double kCos = -0.7071;  // 135 degrees: beyond it a triangle says nothing about the surface's normal
  constexpr double kApart = 0.5;    // pixels, from the ends
  DepthTriangle const shape = triangulation.shape(t);
  for (int i = 0; i < 3; ++i) {
    if (triangulation.triangle(t).next[i] >= 0) continue;
    auto const is_held = [&](int k) { return triangulation.vertex(triangulation.triangle(t).vertex[k % 3]).is_held; };
    if (is_held(i + 1) && is_held(i + 2)) continue;
    Eigen::Vector2d const u = shape.corner[(i + 1) % 3], v = shape.corner[(i + 2) % 3], edge = v - u;
    if (!((u - point).dot(v - point) < kCos * (u - point).norm() * (v - point).norm())) continue;
    double const along = (point - u).dot(edge) / edge.squaredNorm();
    Eigen::Vector2d const place = u + along * edge;
    if ((place - u).norm() < kApart || (place - v).norm() < kApart) continue;
    BorderDepth const beside = border_depth(place, edge);
    double const depth =
        beside.x >= 0 ? beside.depth : (1 - along) * shape.depth[(i + 1) % 3] + along * shape.depth[(i + 2) % 3];
    return triangulation.split_edge(t, i, place, depth);
  }
  return -1;
}

VertexMaker::BorderDepth VertexMaker::border_depth(Eigen::Vector2d const& place, Eigen::Vector2d const& edge) const {
  BorderDepth result;
  double nearest = INFINITY;
  for (int y = int(std::floor(place.y())); y <= int(std::ceil(place.y())); ++y)
    for (int x = int(std::floor(place.x())); x <= int(std::ceil(place.x())); ++x) {
      if (!links_.is_object(x, y)) continue;
      Eigen::Vector2d const to = Eigen::Vector2d(x, y) - place;
      if (!(edge.x() * to.y() - edge.y() * to.x() > 0) || !(to.norm() < nearest)) continue;
      nearest = to.norm();
      result.x = x;
      result.y = y;
    }
  if (result.x >= 0)
    result.depth = extend(fit_local_surface(image_, links_, result.x, result.y, tolerance_(result.y, result.x)),
                          place - Eigen::Vector2d(result.x, result.y));
  return result;
}

int VertexMaker::split_border_off(DepthTriangulation& triangulation, int t, int i, DepthField const& field,
                                  double limit) const {
  int const from = triangulation.triangle(t).vertex[(i + 1) % 3], to = triangulation.triangle(t).vertex[(i + 2) % 3];
  if (triangulation.vertex(from).is_held && triangulation.vertex(to).is_held) return -1;
  DepthTriangulation::Vertex const u = triangulation.vertex(from), v = triangulation.vertex(to);
  Eigen::Vector2d const edge = v.position - u.position;
  int const count = int(edge.norm());  // pieces of a pixel or more
  double worst = limit, depth = 0;
  int at = -1;
  for (int k = 1; k < count; ++k) {
    double const along = double(k) / count;
    BorderDepth const beside = border_depth(u.position + along * edge, edge);
    if (beside.x < 0) continue;
    double const off = std::abs((1 - along) * u.depth + along * v.depth - beside.depth);
    double const error = off * double(field.weight(beside.y, beside.x));
    if (!(error > worst)) continue;
    worst = error;
    depth = beside.depth;
    at = k;
  }
  if (at < 0) return -1;
  return triangulation.split_edge(t, i, u.position + double(at) / count * edge, depth);
}

void refine_border(DepthTriangulation& triangulation, DepthField const& field, VertexMaker const& maker, double limit,
                   int max_triangles) {
  struct BorderEdge {
    int triangle, corner;
  };
  std::vector<BorderEdge> open;
  for (int t = 0; t < int(triangulation.triangles().size()); ++t)
    for (int i = 0; i < 3 && triangulation.alive(t); ++i)
      if (triangulation.triangle(t).next[i] < 0) open.push_back({t, i});
  std::vector<int> added;
  while (!open.empty()) {
    auto const [t, i] = open.back();
    open.pop_back();
    if (max_triangles > 0 && triangulation.count() + 1 > max_triangles) break;
    int const vertex = maker.split_border_off(triangulation, t, i, field, limit);
    if (vertex < 0) continue;
    added.push_back(vertex);
    // What splitting leaves: both pieces opposite corner 0, the second in a new triangle; a second border edge of the
    // triangle, if it had one, in one of the two.
    for (int const piece : {t, int(triangulation.triangles().size()) - 1})
      for (int corner = 0; corner < 3; ++corner)
        if (triangulation.triangle(piece).next[corner] < 0) open.push_back({piece, corner});
  }
  for (int const vertex : added) triangulation.restore_delaunay(vertex);
}

void insert_greedily(DepthTriangulation& triangulation, DepthField const& field, VertexMaker const& maker, double limit,
                     int max_triangles, Context& context) {
  GreedyInsertion(triangulation, field, maker, limit, max_triangles, context).run();
}

}  // namespace scanview
