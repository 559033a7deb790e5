#pragma once
#include <cstddef>
#include <cstdint>

#include "viewer/layered/ldi_pixels.h"

// Compiled once for each instruction set (Highway): includes neither Eigen nor OpenCV.

namespace scanview {

/// From grid steps of a cell's face (x, y, depth in steps, 1) to u z, v z and z of the output's camera (perspective) or
/// u, v and z (orthographic).
struct SquareTransform {
  float rows[3][4];
  float depth_scale;  ///< steps in 1/65536 of the cell
  float eye[4];       ///< in grid steps and 1, or the direction of sight and 0
  float facing;       ///< ±1: the side along the depth axis that is to be seen; 0: both
  float half;         ///< where facing is 0: half the side of a square, in pixels (times z: perspective)
  float bias;         ///< how much farther a square counts at its edge, in units of depth
  float near;         ///< nothing nearer is drawn
  bool perspective;
};

/// What is seen of a square.
struct SquareSample {
  std::uint32_t color;  ///< of LdiPixels
  float depth;          ///< of its middle

  /// Which of two at one depth wins.
  bool operator<(SquareSample const& other) const {
    return color != other.color ? color < other.color : depth < other.depth;
  }
};

/// How far squares count at each pixel of a picture (SquareTransform::bias; infinite where there is none), and the
/// nearest; rows without gaps.
struct SquareTarget {
  float* depth;
  SquareSample* samples;
  std::int32_t width, height;
};

/// Draws pixels [first, first + count) of a cell, each the box around its grid step, a pixel at least; the nearest
/// depth wins, of equal ones the smaller sample, whatever the order. Pixels that cover less than a half are left out.
void draw_squares(LdiPixels const& pixels, std::size_t first, std::size_t count, SquareTransform const& transform,
                  SquareTarget const& target);

}  // namespace scanview
