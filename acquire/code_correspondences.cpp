#include "acquire/code_correspondences.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <optional>

#include "base/parallel.h"

namespace scanview {
namespace {

constexpr int kLeastPixels = 2;
constexpr double kWidest = 3;  // standard deviation of a cell's pixels, in pixels: beyond, it is seen in two places

/// The pixels of one cell of the projector, in one camera.
struct Cell {
  std::int64_t square = 0;
  std::int32_t x = 0, y = 0, count = 0;

  void add(std::int32_t at_x, std::int32_t at_y) {
    x += at_x, y += at_y;
    square += static_cast<std::int64_t>(at_x) * at_x + static_cast<std::int64_t>(at_y) * at_y;
    ++count;
  }
  Eigen::Vector2d middle() const { return Eigen::Vector2d(x, y) / count; }
  bool is_good() const {
    return count >= kLeastPixels && static_cast<double>(square) / count - middle().squaredNorm() <= kWidest * kWidest;
  }
};

/// Calls work(x, y, column, row) for every pixel that has both.
template <typename Work>
void for_each_pixel(DecodedSide const& side, Work const& work) {
  for (int y = 0; y < side.rows.rows; ++y) {
    int const* const rows = side.rows[y];
    float const* const codes = side.image.code[y];
    for (int x = 0; x < side.rows.cols; ++x)
      if (rows[x] >= 0 && side.image.has_code(x, y))
        work(x, y, static_cast<std::size_t>(std::max(codes[x], 0.0F)), static_cast<std::size_t>(rows[x]));
  }
}

/// A camera's pixels by the projector's columns: put there by counting, which takes a tenth of the time of sorting.
class ColumnPixels {
 public:
  struct Pixel {
    std::uint16_t row, x, y;
  };

  explicit ColumnPixels(DecodedSide const& side) {
    for_each_pixel(side, [&](int, int, std::size_t column, std::size_t row) {
      if (column + 2 > starts_.size()) starts_.resize(column + 2, 0);
      ++starts_[column + 1];
      rows_ = std::max(rows_, row + 1);
    });
    std::partial_sum(starts_.begin(), starts_.end(), starts_.begin());
    pixels_.resize(starts_.back());
    auto next = starts_;
    for_each_pixel(side, [&](int x, int y, std::size_t column, std::size_t row) {
      pixels_[next[column]++] = {static_cast<std::uint16_t>(row), static_cast<std::uint16_t>(x),
                                 static_cast<std::uint16_t>(y)};
    });
  }

  std::size_t columns() const { return starts_.size() - 1; }
  std::size_t rows() const { return rows_; }
  /// What a column's cells consist of; `cells` is memory to use again, as many as there are rows.
  void collect(std::size_t column, std::vector<Cell>& cells) const {
    std::fill(cells.begin(), cells.end(), Cell{});
    for (std::size_t i = starts_[column]; i < starts_[column + 1]; ++i) {
      Pixel const& pixel = pixels_[i];
      cells[pixel.row].add(pixel.x, pixel.y);
    }
  }

 private:
  std::vector<std::size_t> starts_ = {0};  ///< of each column's pixels, and their end
  std::vector<Pixel> pixels_;
  std::size_t rows_ = 0;
};

}  // namespace

std::vector<Correspondence> code_correspondences(DecodedSide const& left, DecodedSide const& right, Context& context) {
  if (left.rows.empty() || right.rows.empty()) return {};
  std::array<std::optional<ColumnPixels>, 2> sides;
  for_each_index(context, 2, [&](std::size_t s) { sides[s].emplace(s == 0 ? left : right); });
  std::size_t const columns = std::min(sides[0]->columns(), sides[1]->columns());
  std::size_t const rows = std::max(sides[0]->rows(), sides[1]->rows());
  std::vector<Correspondence> matches;
  std::array<std::vector<Cell>, 2> cells = {std::vector<Cell>(rows), std::vector<Cell>(rows)};
  for (std::size_t column = 0; column < columns; ++column) {
    for (std::size_t s = 0; s < 2; ++s) sides[s]->collect(column, cells[s]);
    for (std::size_t row = 0; row < rows; ++row)
      if (cells[0][row].is_good() && cells[1][row].is_good())
        matches.push_back({cells[0][row].middle(), cells[1][row].middle(), 0.3F});
  }
  return matches;
}

}  // namespace scanview
