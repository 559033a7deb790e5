#pragma once
#include <cstddef>
#include <cstdint>

// Compiled once for each instruction set (Highway): includes neither Eigen nor OpenCV.

namespace scanview {

/// Planes n · p = offset, a component an array that may be read 16 elements beyond its end.
struct FacingPlanes {
  float const *x, *y, *z, *offset;
};

/// Sets the bits of those planes in [begin, end) before which the eye lies, or, within what single precision may lose,
/// in which; or, with side −1 instead of 1, behind which. eye: x, y, z, 1; or a direction and 0.
void facing_bits(FacingPlanes const& planes, float const (&eye)[4], float side, std::size_t begin, std::size_t end,
                 std::uint64_t* bits);

/// A picture of numbers, rows `stride` elements apart; at least 16 more may be read beyond a row.
struct PictureSize {
  int width, height, stride;
};
/// to(x, y): the least of from(x ± step, y ± step), and, with_middle, of those with x and y between; beyond an edge the
/// pixel on it counts.
void window_minimum(float const* from, PictureSize const& size, int step, bool with_middle, float* to);

}  // namespace scanview
