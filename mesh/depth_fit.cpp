#include "mesh/depth_fit.h"

#include <Eigen/SparseCholesky>
#include <algorithm>

namespace scanview {
namespace {

constexpr double kHeld = 0.05;  // pixels that hold each vertex where it is

class DepthFit {
 public:
  DepthFit(DepthTriangulation& triangulation, DepthField const& field, double limit, std::vector<TriangleError> errors)
      : triangulation_(triangulation), field_(field), limit_(limit), before_(std::move(errors)) {
    int const vertices = int(triangulation.vertices().size());
    unknown_of_.assign(vertices, -1);
    for (int t = 0; t < int(triangulation.triangles().size()); ++t) {
      if (!triangulation.alive(t)) continue;
      alive_.push_back(t);
      sums_.push_back(scan_sums(field, triangulation.shape(t)));
      for (int const v : triangulation.triangle(t).vertex)
        if (unknown_of_[v] < 0 && !triangulation.vertex(v).is_held) {
          unknown_of_[v] = int(vertex_of_.size());
          vertex_of_.push_back(v);
          start_.push_back(triangulation.vertex(v).depth);
        }
    }
  }

  std::vector<TriangleError> run() {
    if (vertex_of_.empty()) return before_;
    Eigen::VectorXd const change = solve();
    if (!change.allFinite()) return before_;
    for (std::size_t u = 0; u < vertex_of_.size(); ++u) triangulation_.set_depth(vertex_of_[u], start_[u] + change[u]);
    after_ = scan_errors(triangulation_, field_);
    go_back(change);
    return after_;
  }

 private:
  bool is_beyond(int t) const { return double(after_[t].worst) > std::max(limit_, double(before_[t].worst)); }

  Eigen::VectorXd solve() {
    int const unknowns = int(vertex_of_.size());
    std::vector<Eigen::Triplet<double>> entries;
    entries.reserve(6 * alive_.size() + unknowns);
    Eigen::VectorXd right = Eigen::VectorXd::Zero(unknowns);
    std::vector<double> weights(unknowns, 0), pixels(unknowns, 0);
    for (std::size_t k = 0; k < alive_.size(); ++k) {
      DepthTriangle shape = triangulation_.shape(alive_[k]);
      int unknown[3];
      for (int i = 0; i < 3; ++i) {
        unknown[i] = unknown_of_[triangulation_.triangle(alive_[k]).vertex[i]];
        if (unknown[i] < 0) continue;
        shape.depth[i] = start_[unknown[i]];
        weights[unknown[i]] += sums_[k].w;
        pixels[unknown[i]] += sums_[k].pixels;
      }
      CornerEquations const equations = corner_equations(shape, sums_[k]);
      for (int i = 0; i < 3; ++i) {
        if (unknown[i] < 0) continue;
        right[unknown[i]] += equations.right[i];
        for (int j = 0; j < 3; ++j)
          if (unknown[j] >= 0 && unknown[i] >= unknown[j])
            entries.emplace_back(unknown[i], unknown[j], equations.matrix(i, j));
      }
    }
    for (int u = 0; u < unknowns; ++u) entries.emplace_back(u, u, pixels[u] > 0 ? kHeld * weights[u] / pixels[u] : 1.0);
    Eigen::SparseMatrix<double> matrix(unknowns, unknowns);
    matrix.setFromTriplets(entries.begin(), entries.end());
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(right);
  }

  /// Halves, then takes back, the changes of the vertices of triangles beyond the limit, until there are none. At the
  /// old depths no triangle is beyond it.
  void go_back(Eigen::VectorXd const& change) {
    std::vector<char> way(vertex_of_.size(), 2);  // halves of the change
    std::vector<int> around, open;
    for (int const t : alive_)
      if (is_beyond(t)) open.push_back(t);
    while (!open.empty()) {
      int const t = open.back();
      open.pop_back();
      if (!is_beyond(t)) continue;
      for (int const v : triangulation_.triangle(t).vertex) {
        int const u = unknown_of_[v];
        if (u < 0 || way[u] == 0) continue;
        --way[u];
        triangulation_.set_depth(v, start_[u] + 0.5 * way[u] * change[u]);
        triangulation_.triangles_around(v, around);
        for (int const n : around) {
          after_[n] = scan_error(field_, triangulation_.shape(n));
          if (is_beyond(n)) open.push_back(n);
        }
      }
    }
  }

  DepthTriangulation& triangulation_;
  DepthField const& field_;
  double limit_;
  std::vector<TriangleError> before_, after_;
  std::vector<int> alive_;
  std::vector<TriangleSums> sums_;  ///< of the alive, at the depths at the start
  std::vector<int> unknown_of_, vertex_of_;
  std::vector<double> start_;
};

}  // namespace

std::vector<TriangleError> scan_errors(DepthTriangulation const& triangulation, DepthField const& field) {
  std::vector<TriangleError> errors(triangulation.triangles().size());
  for (int t = 0; t < int(errors.size()); ++t)
    if (triangulation.alive(t)) errors[t] = scan_error(field, triangulation.shape(t));
  return errors;
}

std::vector<TriangleError> fit_depths(DepthTriangulation& triangulation, DepthField const& field, double limit,
                                      std::vector<TriangleError> errors) {
  return DepthFit(triangulation, field, limit, std::move(errors)).run();
}

}  // namespace scanview
