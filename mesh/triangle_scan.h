#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>

namespace scanview {

/// Calls `visit(x, y, wa, wb, wc)` for every pixel centre in a triangle, its border included (to 1e-9 pixels), with
/// barycentric weights that sum to one. `width` and `height` clip. A triangle without area visits nothing.
template <typename Visit>
void for_each_pixel(Eigen::Vector2d const& a, Eigen::Vector2d const& b, Eigen::Vector2d const& c, int width, int height,
                    Visit&& visit) {
  constexpr double kOnBorder = 1e-9;
  double const area = (b.x() - a.x()) * (c.y() - a.y()) - (b.y() - a.y()) * (c.x() - a.x());
  if (!(std::abs(area) > 0)) return;
  auto const limits = std::minmax({a.y(), b.y(), c.y()});
  int const first_row = int(std::ceil(std::max(limits.first - kOnBorder, 0.0)));
  int const last_row = int(std::floor(std::min(limits.second + kOnBorder, height - 1.0)));
  for (int y = first_row; y <= last_row; ++y) {
    double low = INFINITY, high = -INFINITY;
    auto cut = [&](Eigen::Vector2d const& p, Eigen::Vector2d const& q) {
      double const row = std::clamp(double(y), limits.first, limits.second);
      if (row < std::min(p.y(), q.y()) || row > std::max(p.y(), q.y())) return;
      if (p.y() == q.y()) {
        low = std::min({low, p.x(), q.x()});
        high = std::max({high, p.x(), q.x()});
        return;
      }
      double const x = p.x() + (row - p.y()) / (q.y() - p.y()) * (q.x() - p.x());
      low = std::min(low, x);
      high = std::max(high, x);
    };
    cut(a, b);
    cut(b, c);
    cut(c, a);
    int const first = int(std::ceil(std::max(low - kOnBorder, 0.0)));
    int const last = int(std::floor(std::min(high + kOnBorder, width - 1.0)));
    for (int x = first; x <= last; ++x) {
      double const wb = ((x - a.x()) * (c.y() - a.y()) - (y - a.y()) * (c.x() - a.x())) / area;
      double const wc = ((b.x() - a.x()) * (y - a.y()) - (b.y() - a.y()) * (x - a.x())) / area;
      // Beyond 0 and 1 there is rounding only, which grows without bounds as the area shrinks.
      double const b_in = std::clamp(wb, 0.0, 1.0), c_in = std::clamp(wc, 0.0, 1.0 - b_in);
      visit(x, y, 1 - b_in - c_in, b_in, c_in);
    }
  }
}

}  // namespace scanview
