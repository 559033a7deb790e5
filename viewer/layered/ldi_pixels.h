#pragma once
#include <cstddef>
#include <cstdint>

// What the splatting kernels work on: includes neither Eigen nor OpenCV, as raster/raster_types.h.

namespace scanview {

/// LDI pixels of a cell, a component an array; kernels read kLdiPadding bytes beyond their ends. Along the axes of the
/// face that a block belongs to (LdiLattice): x, y: the grid point; depth: in 1/65536 of the cell; color: square roots
/// of linear light, red lowest, and coverage in the highest byte; slopes: change of depth with x and y, 1/127.
struct LdiPixels {
  std::uint8_t const* x = nullptr;
  std::uint8_t const* y = nullptr;
  std::uint16_t const* depth = nullptr;
  std::uint32_t const* color = nullptr;
  std::int8_t const* slope_x = nullptr;
  std::int8_t const* slope_y = nullptr;
};
inline constexpr std::size_t kLdiPadding = 64;
inline constexpr std::size_t kLdiPixelBytes = 10;
inline constexpr int kLdiSlope = 127;

/// Where pixels come from: reference images alone; images, where the cell's children cover a part of the place; the
/// cell's children (and images there).
enum class LdiKind : std::uint8_t { unfiltered, patch, filtered };
inline constexpr int kLdiKinds = 3;

/// LDI pixels of one face of a cell that lie together, none without pixels.
struct LdiBlock {
  static constexpr std::uint32_t kMost = 256;
  std::uint32_t first = 0;
  std::uint16_t count = 0;
  std::uint8_t face = 0;
  LdiKind kind = LdiKind::unfiltered;
  /// Bounds in grid steps: grid points low .. high, depths from low to high + 1.
  std::uint8_t low[3] = {}, high[3] = {};
  std::uint8_t unused[2] = {};
};
static_assert(sizeof(LdiBlock) == 16);

}  // namespace scanview
