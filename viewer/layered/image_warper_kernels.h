#pragma once
#include <cstddef>
#include <cstdint>

// Compiled once for each instruction set (Highway): includes neither Eigen nor OpenCV.

namespace scanview {

/// Part of a row of a reference picture, from its first to its last depth: pixels (x, y), (x + 1, y), ...
struct WarpRow {
  std::uint32_t begin;  ///< of its depths in the array of all
  std::int32_t count, x, y;
};

/// From the pixels of one reference picture to those of the frame. With q = (x, y, 1) and m's row k = (M, b):
///   perspective reference: r_k = depth (M q) + b;   orthographic: r_k = M q + b depth
///   perspective frame: the point falls on (r_0, r_1) / r_2;   orthographic: on (r_0, r_1).   r_2 is its depth.
struct ImageWarp {
  bool from_perspective, to_perspective;
  double m[3][4];
  float half_x, half_y;  ///< half the side of the stamp, in pixels of the frame, before depth and 1 / r_2 enlarge it
  float near;            ///< what is not farther is not drawn
};

/// A frame's depths (infinite where there is nothing) and which of all depths each is; rows without gaps.
struct WarpTarget {
  float* depth;
  std::uint32_t* index;
  std::int32_t width, height;
};

/// Half the side of the largest stamp, in pixels: what bounds a point's cost.
inline constexpr float kMostHalfStamp = 32;

/// Draws each depth as the rectangle of its stamp, of a pixel at least: the pixels whose centre lies in it get what is
/// nearer than they have. NaN is skipped, and what is not finite in the frame. `depths` may be read 16 elements beyond
/// the rows' end. Needs indices that only ever rise: equal depths keep the lower one.
void warp_rows(ImageWarp const& warp, WarpRow const* rows, std::size_t count, float const* depths,
               WarpTarget const& target);

}  // namespace scanview
