#include "mesh/voronoi_probing.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <queue>
#include <vector>

#include "base/random.h"

namespace scanview {
namespace {

/// The middle of the circle around a triangle; far away where its corners are nearly on a line.
Eigen::Vector2d circle_center(DepthTriangle const& t) {
  Eigen::Vector2d const u = t.corner[1] - t.corner[0], v = t.corner[2] - t.corner[0];
  double const uu = u.squaredNorm(), vv = v.squaredNorm();
  return t.corner[0] + Eigen::Vector2d(v.y() * uu - u.y() * vv, u.x() * vv - v.x() * uu) / (2 * t.turn());
}

class Probing {
 public:
  Probing(DepthTriangulation& triangulation, DepthField const& field, VertexMaker const& maker, double limit,
          int max_triangles, Context& context)
      : m_(triangulation),
        field_(field),
        maker_(maker),
        limit_(limit),
        max_triangles_(max_triangles),
        context_(context) {}

  void run() {
    for (int t = 0; t < int(m_.triangles().size()); ++t) look_at(t);
    while (!queue_.empty()) {
      if (probes_ % 1024 == 0) context_.check_cancelled();
      Probe const probe = queue_.top();
      queue_.pop();
      if (stamps_[probe.triangle] != probe.stamp) continue;
      if (max_triangles_ > 0 && m_.count() + 2 > max_triangles_) return;
      probe_edge(probe);
    }
  }

 private:
  struct Probe {
    double priority;
    int triangle, edge;
    std::uint32_t stamp;
    int failures;  ///< probes of it that met no new pixel
    bool operator<(Probe const& other) const {
      if (priority != other.priority) return priority < other.priority;
      return triangle != other.triangle ? triangle > other.triangle : edge > other.edge;
    }
  };

  void look_at(int t) {
    if (std::size_t(t) >= stamps_.size()) stamps_.resize(t + 64, 0);
    stamps_[t] = ++stamp_;
    DepthTriangle const shape = m_.shape(t);
    if (!(scan_error(field_, shape).worst > limit_)) return;
    for (int i = 0; i < 3; ++i) {
      double const a = shape.depth[(i + 1) % 3], b = shape.depth[(i + 2) % 3];
      double const size = (shape.corner[(i + 1) % 3] - shape.corner[(i + 2) % 3]).squaredNorm();
      // Flat pairs have no difference, but their cells may hide one.
      constexpr double kLeastDifference = 1e-3;
      double const greater = std::max(std::abs(a), std::abs(b));
      double const difference = greater > 0 ? std::abs(a - b) / greater : 0;
      queue_.push({(difference + kLeastDifference) * size * nearness(greater), t, i, stamp_, 0});
    }
  }

  /// Linear depth is one over depth under perspective: the greater, the nearer. Without perspective nothing is nearer.
  double nearness(double greater) const { return maker_.is_perspective() ? greater : 1; }

  void probe_edge(Probe probe) {
    int const t = probe.triangle, n = m_.triangle(t).next[probe.edge];
    DepthTriangle const shape = m_.shape(t);
    Eigen::Vector2d const from = circle_center(shape);
    Eigen::Vector2d const middle = (shape.corner[(probe.edge + 1) % 3] + shape.corner[(probe.edge + 2) % 3]) / 2;
    Eigen::Vector2d const to = n >= 0 ? circle_center(m_.shape(n)) : middle;
    CounterRandom random(context_.seed, probes_++);
    Eigen::Vector2d const place = from + random.uniform() * (to - from);
    double const x = std::round(place.x()), y = std::round(place.y());
    int const in = x >= 0 && y >= 0 && x < field_.width() && y < field_.height() && field_.weight(int(y), int(x)) > 0
                       ? triangle_at(t, n, {x, y})
                       : -1;
    auto const added = in < 0 ? std::nullopt : m_.insert(in, {x, y}, maker_.depth_at(int(x), int(y)));
    if (added) {
      m_.restore_delaunay(*added);
      m_.triangles_around(*added, around_);
      for (int const around : around_) look_at(around);
      return;
    }
    constexpr int kTries = 4;
    if (++probe.failures == kTries) return;
    probe.priority /= 2;
    queue_.push(probe);
  }

  /// The triangle that holds a place near triangles t and n: those and what is around their corners. −1: none of them.
  int triangle_at(int t, int n, Eigen::Vector2d const& place) {
    auto const holds = [&](int candidate) {
      DepthTriangle const shape = m_.shape(candidate);
      for (int i = 0; i < 3; ++i) {
        Eigen::Vector2d const edge = shape.corner[(i + 1) % 3] - shape.corner[i], offset = place - shape.corner[i];
        if (edge.x() * offset.y() - edge.y() * offset.x() < 0) return false;
      }
      return true;
    };
    if (holds(t)) return t;
    if (n >= 0 && holds(n)) return n;
    for (int const v : m_.triangle(t).vertex) {
      m_.triangles_around(v, around_);
      for (int const candidate : around_)
        if (holds(candidate)) return candidate;
    }
    return -1;
  }

  DepthTriangulation& m_;
  DepthField const& field_;
  VertexMaker const& maker_;
  double limit_;
  int max_triangles_;
  Context& context_;
  std::priority_queue<Probe> queue_;
  std::vector<std::uint32_t> stamps_;  ///< of the latest look at a triangle
  std::uint32_t stamp_ = 0;
  std::uint64_t probes_ = 0;
  std::vector<int> around_;
};

}  // namespace

void probe_voronoi_edges(DepthTriangulation& triangulation, DepthField const& measure, VertexMaker const& maker,
                         double limit, int max_triangles, Context& context) {
  Probing(triangulation, measure, maker, limit, max_triangles, context).run();
  insert_greedily(triangulation, measure, maker, limit, max_triangles, context);
}

}  // namespace scanview
