#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <utility>

namespace scanview {

/// The least integer that is not less than x, which is not negative: a library call without SSE 4.1.
inline int ceil_of_positive(double x) {
  int const below = int(x);
  return below + (below < x);
}

/// Calls `visit(y, begin, end)` for every row of a triangle that holds pixel centres, with the columns [begin, end) of
/// those it holds. Half open: a centre on an edge between two triangles belongs to exactly one of them, because both
/// compute where the edge crosses a row from its ends in the same order. `width` and `height` clip. A triangle without
/// area visits nothing.
template <typename Visit>
void for_each_span(Eigen::Vector2d a, Eigen::Vector2d b, Eigen::Vector2d c, int width, int height, Visit&& visit) {
  auto const before = [](Eigen::Vector2d const& p, Eigen::Vector2d const& q) {
    return p.y() < q.y() || (p.y() == q.y() && p.x() < q.x());
  };
  if (before(b, a)) std::swap(a, b);
  if (before(c, b)) std::swap(b, c);
  if (before(b, a)) std::swap(a, b);
  double const turn = (b.x() - a.x()) * (c.y() - a.y()) - (c.x() - a.x()) * (b.y() - a.y());
  if (!(std::abs(turn) > 0)) return;
  bool const long_is_left = turn > 0;
  double const long_slope = (c.x() - a.x()) / (c.y() - a.y());
  auto const rows = [&](Eigen::Vector2d const& from, Eigen::Vector2d const& to) {
    int const first = ceil_of_positive(std::max(from.y(), 0.0)),
              end = ceil_of_positive(std::max(std::min(to.y(), double(height)), 0.0));
    if (first >= end) return;
    double const slope = (to.x() - from.x()) / (to.y() - from.y());
    for (int y = first; y < end; ++y) {
      double left = a.x() + (y - a.y()) * long_slope, right = from.x() + (y - from.y()) * slope;
      if (!long_is_left) std::swap(left, right);
      int const begin_x = ceil_of_positive(std::max(left, 0.0)),
                end_x = ceil_of_positive(std::max(std::min(right, double(width)), 0.0));
      if (begin_x < end_x) visit(y, begin_x, end_x);
    }
  };
  rows(a, b);
  rows(b, c);
}

}  // namespace scanview
