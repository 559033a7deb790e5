#include "acquire/code_correspondences.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace scanview {
namespace {

constexpr int kLeastPixels = 2;
constexpr double kWidest = 3;  // standard deviation of a cell's pixels, in pixels: beyond, it is seen in two places

/// The pixels of one cell of the projector.
struct Cell {
  std::uint32_t key = 0;  ///< column and row
  double x = 0, y = 0, square = 0;
  int count = 0;

  Eigen::Vector2d middle() const { return {x / count, y / count}; }
  bool is_good() const { return count >= kLeastPixels && square / count - middle().squaredNorm() <= kWidest * kWidest; }
};

/// Good cells, by key. Sorted pixels in place of a map: a tenth of the time.
std::vector<Cell> cells_of(DecodedSide const& side) {
  std::vector<std::uint64_t> pixels;  // key, y, x
  for (int y = 0; y < side.rows.rows; ++y)
    for (int x = 0; x < side.rows.cols; ++x) {
      if (side.rows(y, x) < 0 || !side.image.has_code(x, y)) continue;
      auto const column = static_cast<std::uint64_t>(std::max(side.image.code(y, x), 0.0F));
      pixels.push_back(column << 48 | static_cast<std::uint64_t>(side.rows(y, x)) << 32 |
                       static_cast<std::uint64_t>(y) << 16 | static_cast<std::uint64_t>(x));
    }
  std::sort(pixels.begin(), pixels.end());
  std::vector<Cell> cells;
  Cell cell;
  auto const finish = [&] {
    if (cell.is_good()) cells.push_back(cell);
  };
  for (std::uint64_t const pixel : pixels) {
    auto const key = static_cast<std::uint32_t>(pixel >> 32);
    if (key != cell.key) {
      finish();
      cell = {key};
    }
    auto const x = static_cast<double>(pixel & 0xffff), y = static_cast<double>(pixel >> 16 & 0xffff);
    cell.x += x, cell.y += y;
    cell.square += x * x + y * y;
    ++cell.count;
  }
  finish();
  return cells;
}

}  // namespace

std::vector<Correspondence> code_correspondences(DecodedSide const& left, DecodedSide const& right) {
  if (left.rows.empty() || right.rows.empty()) return {};
  std::vector<Cell> const in_left = cells_of(left), in_right = cells_of(right);
  std::vector<Correspondence> matches;
  auto other = in_right.begin();
  for (Cell const& cell : in_left) {
    while (other != in_right.end() && other->key < cell.key) ++other;
    if (other == in_right.end()) break;
    if (other->key == cell.key) matches.push_back({cell.middle(), other->middle(), 0.3F});
  }
  return matches;
}

}  // namespace scanview
