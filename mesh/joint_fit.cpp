#include "mesh/joint_fit.h"

#include <Eigen/Dense>
#include <algorithm>
#include <climits>
#include <cmath>
#include <optional>

#include "mesh/depth_fit.h"

namespace scanview {
namespace {

constexpr double kLeastHeight = 0.7;  // pixels

/// Twice the area over the longest side; negative where the corners turn the wrong way.
double least_height(DepthTriangle const& t) {
  double longest = 0;
  for (int i = 0; i < 3; ++i) longest = std::max(longest, (t.corner[(i + 1) % 3] - t.corner[i]).squaredNorm());
  return longest > 0 ? t.turn() / std::sqrt(longest) : 0;
}

class JointFit {
 public:
  JointFit(DepthTriangulation& triangulation, DepthField const& field, JointFitOptions const& options,
           std::vector<TriangleError> errors, Context& context)
      : m_(triangulation), field_(field), options_(options), context_(context), errors_(std::move(errors)) {}

  std::vector<TriangleError> run() {
    for (int sweep = 0; sweep < options_.sweeps; ++sweep) {
      context_.check_cancelled();
      if (options_.worth > 0) add_vertices();
      flip_edges();
      if (options_.fewer) join_vertices(options_.worth > 0 ? options_.worth : INFINITY, INT_MAX);
      move_vertices();
      errors_ = fit_depths(m_, field_, options_.limit, std::move(errors_));
    }
    return std::move(errors_);
  }

 private:
  /// Errors and least height of the triangles that a change replaces, and whether others are better.
  struct Before {
    double squares = 0, worst = 0, height = INFINITY;
  };
  void add(Before& before, int t) const {
    before.squares += errors_[t].squares;
    before.worst = std::max(before.worst, double(errors_[t].worst));
    before.height = std::min(before.height, least_height(m_.shape(t)));
  }
  bool is_sliver(Before const& before, DepthTriangle const& shape) const {
    return !(least_height(shape) >= std::min(kLeastHeight, before.height));
  }
  bool is_beyond(Before const& before, TriangleError const& error) const {
    return double(error.worst) > std::max(options_.limit, before.worst);
  }

  void flip_edges() {
    std::vector<int> open;
    for (int t = 0; t < int(m_.triangles().size()); ++t)
      if (m_.alive(t)) open.push_back(t);
    constexpr int kRounds = 3;
    std::vector<char> waits(m_.triangles().size(), 1);  // for its first turn, in which it tries the edge to us
    for (int round = 0; round < kRounds && !open.empty(); ++round) {
      std::vector<int> changed;
      for (int const t : open) {
        waits[t] = 0;
        for (int i = 0; i < 3; ++i) {
          int const n = m_.triangle(t).next[i];
          if (n < 0 || (round == 0 && waits[n]) || !try_flip(t, i)) continue;
          changed.push_back(t);
          changed.push_back(n);
          break;
        }
      }
      std::sort(changed.begin(), changed.end());
      changed.erase(std::unique(changed.begin(), changed.end()), changed.end());
      open = std::move(changed);
    }
  }

  bool try_flip(int t, int i) {
    int const n = m_.triangle(t).next[i];
    Before before;
    add(before, t);
    add(before, n);
    if (before.squares == 0) return false;
    DepthTriangle const one = m_.shape(t), other = m_.shape(n);
    int const j = m_.opposite_of(n, t);
    DepthTriangle const left{{one.corner[i], one.corner[(i + 1) % 3], other.corner[j]},
                             {one.depth[i], one.depth[(i + 1) % 3], other.depth[j]}};
    DepthTriangle const right{{one.corner[i], other.corner[j], one.corner[(i + 2) % 3]},
                              {one.depth[i], other.depth[j], one.depth[(i + 2) % 3]}};
    if (is_sliver(before, left) || is_sliver(before, right) || !m_.can_flip(t, i)) return false;
    constexpr double kBetter = 0.999;
    TriangleError const left_error = scan_error(field_, left);
    if (left_error.squares > kBetter * before.squares || is_beyond(before, left_error)) return false;
    TriangleError const right_error = scan_error(field_, right);
    if (left_error.squares + right_error.squares > kBetter * before.squares || is_beyond(before, right_error))
      return false;
    m_.flip(t, i);
    errors_[t] = left_error;
    errors_[n] = right_error;
    return true;
  }

  /// Puts vertices where they pay most.
  void add_vertices() {
    std::vector<Offer> offers = best_offers();
    if (options_.max_triangles > 0 && is_full() && !offers.empty()) {
      constexpr int kExchanged = 20;  // at most one of so many vertices, a sweep
      std::size_t const count = std::min(offers.size(), m_.vertices().size() / kExchanged + 1);
      join_vertices(offers[count - 1].gain / 2, int(count));
      offers = best_offers();
    }
    std::vector<char> changed(m_.triangles().size(), 0);
    for (Offer const& offer : offers) {
      if (is_full()) return;
      int const next = offer.edge >= 0 ? m_.triangle(offer.triangle).next[offer.edge] : -1;
      if (changed[offer.triangle] || next >= int(changed.size()) || (next >= 0 && changed[next])) continue;
      changed[offer.triangle] = 1;
      if (next >= 0) changed[next] = 1;
      take(offer, next);
    }
  }

  bool is_full() const { return options_.max_triangles > 0 && m_.count() + 2 > options_.max_triangles; }

  /// A place for a vertex, the depth there that lowers the squares most, and by how much.
  struct Offer {
    int triangle = -1, edge = -1;  ///< in the triangle, or on its edge opposite that corner
    Eigen::Vector2d place{0, 0};
    double depth = 0, old_depth = 0, gain = 0;
  };

  /// At a place in the triangle, or on the edge opposite `edge` that it shares with its neighbour.
  Offer offer_at(int t, int edge, Eigen::Vector2d const& place) const {
    Offer offer{t, edge, place, 0, m_.shape(t).plane().at(place), 0};
    double matrix = 0, right = 0;
    auto const add_parts = [&](int of, int without) {
      DepthTriangle const whole = m_.shape(of);
      for (int i = 0; i < 3; ++i) {
        if (i == without) continue;
        DepthTriangle part = whole;
        part.corner[i] = place;
        part.depth[i] = offer.old_depth;
        CornerEquations const equations = corner_equations(part, scan_sums(field_, part));
        matrix += equations.matrix(i, i);
        right += equations.right[i];
      }
    };
    add_parts(t, edge);
    if (edge >= 0) add_parts(m_.triangle(t).next[edge], m_.opposite_of(m_.triangle(t).next[edge], t));
    if (!(matrix > 0)) return offer;
    offer.depth = offer.old_depth + right / matrix;
    offer.gain = right * right / matrix;
    return offer;
  }

  /// Of every triangle the best, where it gains more than a vertex is worth, the best of all first.
  std::vector<Offer> best_offers() const {
    std::vector<Offer> offers;
    for (int t = 0; t < int(m_.triangles().size()); ++t)
      if (m_.alive(t) && errors_[t].squares > options_.worth)
        if (Offer const offer = best_offer(t); offer.gain > options_.worth) offers.push_back(offer);
    std::sort(offers.begin(), offers.end(), [](Offer const& a, Offer const& b) {
      return a.gain != b.gain ? a.gain > b.gain : a.triangle < b.triangle;
    });
    return offers;
  }

  /// In its middle, or in the middle of its longest edge.
  Offer best_offer(int t) const {
    constexpr int kLeastPixels = 3;
    DepthTriangle const whole = m_.shape(t);
    if (whole.turn() < 2 * kLeastPixels || !(least_height(whole) > 2 * kLeastHeight)) return {};
    Offer const inside = offer_at(t, -1, (whole.corner[0] + whole.corner[1] + whole.corner[2]) / 3);
    int longest = 0;
    auto const length = [&](int i) { return (whole.corner[(i + 1) % 3] - whole.corner[(i + 2) % 3]).squaredNorm(); };
    for (int i = 1; i < 3; ++i)
      if (length(i) > length(longest)) longest = i;
    int const next = m_.triangle(t).next[longest];
    if (next < 0 || !(least_height(m_.shape(next)) > 2 * kLeastHeight)) return inside;
    Offer const on_edge = offer_at(t, longest, (whole.corner[(longest + 1) % 3] + whole.corner[(longest + 2) % 3]) / 2);
    return on_edge.gain > inside.gain ? on_edge : inside;
  }

  void take(Offer const& offer, int next) {
    Before before;
    add(before, offer.triangle);
    if (next >= 0) add(before, next);
    std::optional<int> const v = next < 0 ? m_.insert(offer.triangle, offer.place, offer.depth)
                                          : m_.split_edge(offer.triangle, offer.edge, offer.place, offer.depth);
    if (!v) return;
    errors_.resize(m_.triangles().size());
    m_.triangles_around(*v, around_);
    bool beyond = false;
    for (int const n : around_) {
      errors_[n] = scan_error(field_, m_.shape(n));
      beyond = beyond || is_beyond(before, errors_[n]);
    }
    if (!beyond) return;
    m_.set_depth(*v, offer.old_depth);
    for (int const n : around_) errors_[n] = scan_error(field_, m_.shape(n));
  }

  void move_vertices() {
    for (int v = 0; v < int(m_.vertices().size()); ++v)
      if (m_.vertex(v).triangle >= 0 && !m_.vertex(v).on_border) try_move(v);
  }

  void try_move(int v) {
    m_.triangles_around(v, around_);
    Before before;
    for (int const t : around_) add(before, t);
    if (before.squares == 0) return;
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    double weights = 0, pixels = 0, reach = INFINITY;
    for (int const t : around_) {
      DepthTriangle const shape = m_.shape(t);
      int const k = m_.corner_of(t, v);
      TriangleSums const sums = scan_sums(field_, shape);
      CornerEquations const equations = corner_equations(shape, sums);
      Eigen::Vector2d const slope = shape.plane().slope;
      Eigen::Vector3d const row(1, -slope.x(), -slope.y());
      matrix += equations.matrix(k, k) * row * row.transpose();
      right += equations.right[k] * row;
      weights += sums.w;
      pixels += sums.pixels;
      Eigen::Vector2d const edge = shape.corner[(k + 2) % 3] - shape.corner[(k + 1) % 3];
      reach = std::min(reach, shape.turn() / edge.norm());
    }
    if (pixels == 0) return;
    constexpr double kHeld = 0.05, kTied = 0.1;
    matrix(0, 0) += kHeld * weights / pixels;
    matrix(1, 1) += kTied * before.squares / (reach * reach);
    matrix(2, 2) += kTied * before.squares / (reach * reach);
    Eigen::Vector3d change = matrix.ldlt().solve(right);
    if (!change.allFinite()) return;
    constexpr double kWorthwhile = 1e-2;
    if (right.dot(change) < kWorthwhile * before.squares) return;
    constexpr double kFarthest = 0.4;
    double const length = change.tail<2>().norm();
    if (length > kFarthest * reach) change *= kFarthest * reach / length;
    DepthTriangulation::Vertex const old = m_.vertex(v);
    for (int attempt = 0; attempt < 2; ++attempt, change /= 3) {
      Eigen::Vector2d const place = old.position + change.tail<2>();
      if (!m_.can_move(v, place)) continue;
      m_.move(v, place, old.depth + change[0]);
      if (accept_around(before, 0.9999)) return;
      m_.move(v, old.position, old.depth);
    }
  }

  /// Keeps what was changed in the triangles around_ where it is better.
  bool accept_around(Before const& before, double better) {
    found_.clear();
    double squares = 0;
    for (int const t : around_) {
      DepthTriangle const shape = m_.shape(t);
      if (is_sliver(before, shape)) return false;
      found_.push_back(scan_error(field_, shape));
      squares += found_.back().squares;
      if (is_beyond(before, found_.back()) || squares > better * before.squares) return false;
    }
    for (std::size_t k = 0; k < around_.size(); ++k) errors_[around_[k]] = found_[k];
    return true;
  }

  /// Joins vertices that can be spared, where that adds less than `most_loss` to the squares, `most` at most.
  void join_vertices(double most_loss, int most) {
    struct Spare {
      double loss;
      int vertex;
    };
    std::vector<Spare> order;
    for (int v = 0; v < int(m_.vertices().size()); ++v) {
      if (m_.vertex(v).triangle < 0 || m_.vertex(v).on_border) continue;
      auto const [loss, squares] = bump(v);
      if (loss < 3 * options_.limit && squares < 3 * most_loss) order.push_back({loss, v});
    }
    std::sort(order.begin(), order.end(),
              [](Spare const& a, Spare const& b) { return a.loss != b.loss ? a.loss < b.loss : a.vertex < b.vertex; });
    for (Spare const& spare : order)
      if (try_join(spare.vertex, most_loss) && --most == 0) return;
  }

  /// How far a vertex stands off the plane of its neighbours, in tolerances, and what squared error that would leave:
  /// the mean of λ² over a triangle is a sixth.
  std::pair<double, double> bump(int v) {
    m_.triangles_around(v, around_);
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    DepthTriangulation::Vertex const& at = m_.vertex(v);
    double pixels = 0;
    for (int const t : around_) {
      pixels += m_.shape(t).turn() / 2;
      DepthTriangulation::Vertex const& n = m_.vertex(m_.triangle(t).vertex[(m_.corner_of(t, v) + 1) % 3]);
      Eigen::Vector3d const row(1, n.position.x() - at.position.x(), n.position.y() - at.position.y());
      double const weight = 1 / row.tail<2>().squaredNorm();
      matrix += weight * row * row.transpose();
      right += weight * (n.depth - at.depth) * row;
    }
    int const x = std::clamp(int(std::lround(at.position.x())), 0, field_.width() - 1);
    int const y = std::clamp(int(std::lround(at.position.y())), 0, field_.height() - 1);
    double const height = std::abs(Eigen::Vector3d(matrix.ldlt().solve(right))[0]) * field_.weight(y, x);
    return {height, height * height * pixels / 6};
  }

  /// A triangle around v once v is joined with u.
  DepthTriangle joined(int t, int v, int u) const {
    DepthTriangle shape = m_.shape(t);
    int const k = m_.corner_of(t, v);
    shape.corner[k] = m_.vertex(u).position;
    shape.depth[k] = m_.vertex(u).depth;
    return shape;
  }

  /// How far the surface moves at vertex v where it is joined with u.
  double change_of_join(int v, int u) const {
    Eigen::Vector2d const place = m_.vertex(v).position;
    double least_outside = INFINITY, change = INFINITY;
    for (int const t : around_) {
      if (m_.corner_of(t, u) < 3) continue;
      DepthTriangle const shape = joined(t, v, u);
      double outside = 0;  // of the triangle, as a weight of a corner
      for (int i = 0; i < 3; ++i)
        outside = std::max(outside, -shape.barycentric_slope(i).dot(place - shape.corner[(i + 1) % 3]));
      if (outside >= least_outside) continue;
      least_outside = outside;
      change = std::abs(shape.plane().at(place) - m_.vertex(v).depth);
    }
    return change;
  }

  bool try_join(int v, double most_loss) {
    m_.triangles_around(v, around_);
    Before before;
    for (int const t : around_) add(before, t);
    constexpr int kTried = 2;
    std::vector<std::pair<double, int>> ring;  // by how far the surface would move where the vertex is
    for (int const t : around_) {
      int const u = m_.triangle(t).vertex[(m_.corner_of(t, v) + 1) % 3];
      if (m_.can_collapse(v, u)) ring.emplace_back(change_of_join(v, u), u);
    }
    std::sort(ring.begin(), ring.end());
    if (ring.size() > kTried) ring.resize(kTried);
    int best = -1;
    double least = INFINITY;
    for (auto const& [change, u] : ring) {
      double squares = 0;
      bool good = true;
      for (int const t : around_) {
        if (m_.corner_of(t, u) < 3) continue;
        DepthTriangle const shape = joined(t, v, u);
        good = !is_sliver(before, shape);
        if (!good) break;
        TriangleError const error = scan_error(field_, shape);
        squares += error.squares;
        good = error.worst <= options_.limit && squares < least && squares < before.squares + most_loss;
        if (!good) break;
      }
      if (!good) continue;
      least = squares;
      best = u;
    }
    if (best < 0) return false;
    m_.collapse(v, best);
    for (int const t : around_)
      if (m_.alive(t)) errors_[t] = scan_error(field_, m_.shape(t));
    return true;
  }

  DepthTriangulation& m_;
  DepthField const& field_;
  JointFitOptions options_;
  Context& context_;
  std::vector<TriangleError> errors_;
  std::vector<int> around_;
  std::vector<TriangleError> found_;
};

}  // namespace

std::vector<TriangleError> fit_jointly(DepthTriangulation& triangulation, DepthField const& field,
                                       JointFitOptions const& options, std::vector<TriangleError> errors,
                                       Context& context) {
  return JointFit(triangulation, field, options, std::move(errors), context).run();
}

}  // namespace scanview
