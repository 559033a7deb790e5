#include "acquire/code_correspondences.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <unordered_map>

namespace scanview {
namespace {

constexpr int kLeastPixels = 2;
constexpr double kWidest = 3;  // standard deviation of a cell's pixels, in pixels: beyond, it is seen in two places

struct Cell {
  double x = 0, y = 0, square = 0;
  int count = 0;

  Eigen::Vector2d middle() const { return {x / count, y / count}; }
  bool is_good() const { return count >= kLeastPixels && square / count - middle().squaredNorm() <= kWidest * kWidest; }
};

using Cells = std::unordered_map<std::uint32_t, Cell>;

Cells cells_of(DecodedSide const& side) {
  Cells cells;
  for (int y = 0; y < side.rows.rows; ++y)
    for (int x = 0; x < side.rows.cols; ++x) {
      if (side.rows(y, x) < 0 || !side.image.has_code(x, y)) continue;
      auto const column = static_cast<std::uint32_t>(std::max(side.image.code(y, x), 0.0F));
      Cell& cell = cells[column << 16 | static_cast<std::uint32_t>(side.rows(y, x))];
      cell.x += x, cell.y += y;
      cell.square += static_cast<double>(x) * x + static_cast<double>(y) * y;
      ++cell.count;
    }
  return cells;
}

}  // namespace

std::vector<Correspondence> code_correspondences(DecodedSide const& left, DecodedSide const& right) {
  if (left.rows.empty() || right.rows.empty()) return {};
  Cells const in_left = cells_of(left), in_right = cells_of(right);
  std::vector<std::uint32_t> keys;
  for (auto const& [key, cell] : in_left)
    if (auto const other = in_right.find(key); cell.is_good() && other != in_right.end() && other->second.is_good())
      keys.push_back(key);
  std::sort(keys.begin(), keys.end());  // a hash map has no order of its own
  std::vector<Correspondence> matches;
  for (std::uint32_t const key : keys) {
    Cell const &a = in_left.at(key), &b = in_right.at(key);
    matches.push_back({a.middle(), b.middle(), 0.3F});
  }
  return matches;
}

}  // namespace scanview
