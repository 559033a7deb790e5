#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <unordered_map>
#include <vector>

#include "viewer/layered/ldi_tree.h"

namespace scanview {

/// The LDI of one cell, as its bytes are kept in memory and in files: blocks, then the arrays of pixels.
class LdiContent {
 public:
  struct Pixel {
    std::uint8_t face = 0, x = 0, y = 0;
    LdiKind kind = LdiKind::unfiltered;
    std::int8_t slope_x = 0, slope_y = 0;
    std::uint16_t depth = 0;
    std::uint32_t color = 0;
  };

  LdiContent() = default;
  /// Sorts pixels into blocks: by kind, then by face; up to 16 x 16 grid points and LdiBlock::kMost
  /// pixels a block, layers that lie far apart in different ones.
  LdiContent(std::vector<Pixel> pixels, int resolution);

  std::size_t count() const { return pixels_; }
  std::array<std::uint32_t, kLdiKinds> const& blocks_of_kind() const { return blocks_of_kind_; }
  std::span<LdiBlock const> blocks() const;
  LdiPixels pixels() const;
  std::vector<std::byte> const& bytes() const { return bytes_; }

 private:
  std::size_t pixels_ = 0, blocks_ = 0;
  std::array<std::uint32_t, kLdiKinds> blocks_of_kind_{};
  std::vector<std::byte> bytes_;
};

/// Where the arrays of a cell's content begin: of so many blocks and pixels; `end` is a multiple of 16.
struct LdiLayout {
  std::size_t color, depth, x, y, slope_x, slope_y, end;
  LdiLayout(std::size_t blocks, std::size_t pixels);
};
LdiPixels ldi_pixels(std::byte const* content, std::size_t blocks, std::size_t pixels);

/// All cells in their order, in one piece.
LdiTree tree_of(std::unordered_map<LdiCellKey, LdiContent, LdiCellKeyHash>&& contents, LdiOptions const& options);
/// Parents and children of cells whose keys are there, in LdiTree's order. False where a cell has no parent but is not
/// of the top level, or keys are not sorted as they must be.
bool link_cells(std::vector<LdiCell>& cells, std::vector<std::int32_t>& roots);

}  // namespace scanview
