#pragma once
#include <cstddef>
#include <cstdint>

#include "viewer/layered/ldi_pixels.h"

// Compiled once for each instruction set (Highway): includes neither Eigen nor OpenCV. All sets compute the same bits:
// no fused multiply-add, no approximate reciprocals.

namespace scanview {

/// One layer of an output pixel.
struct alignas(16) OutputLayer {
  float sums[4];    ///< of weight · (red, green, blue) in linear light, and of weights; 1: covered once
  float key;        ///< 1/z (perspective) or −z (orthographic) of the heaviest of its samples
  float tolerance;  ///< what other keys may differ by and be the same surface
  float heaviest;
  float unused;
};
inline constexpr int kOutputLayers = 4;

/// A part of the layered output buffer (Chang 1998, §3.2: "we implement the output buffer as an LDI"): for each pixel
/// up to kOutputLayers layers, near to far. Rows are `stride` pixels apart; the first is pixel (left, top).
struct OutputArea {
  OutputLayer* layers[kOutputLayers];
  std::uint8_t* counts;         ///< of each pixel's layers
  std::uint8_t const* stencil;  ///< not null: only pixels where it is not 0 are drawn on
  int stride, left, top, right, bottom;
};

/// From grid steps of a cell's face (x, y, depth in steps, 1) to u z, v z and z of the output's camera (perspective) or
/// u, v and z (orthographic).
struct SplatTransform {
  float rows[3][4];
  float depth_scale;    ///< steps in 1/65536 of the cell
  float facing;         ///< ±1: only surfaces whose grid turns that way on the screen; 0: all
  float tolerance;      ///< in units of depth
  float near;           ///< perspective: nothing nearer is drawn
  float least, widest;  ///< reach of a splat, in pixels
  int perspective;
  int fills;  ///< a layer takes no more than what it lacks to be covered once
};

/// Draws pixels [first, first + count) of a cell. A splat is a bilinear kernel as wide as the grid is on the screen
/// there, at least a pixel; its depth follows its tangent plane. A sample is added to the layer whose depth is its own
/// within the greater of their tolerances, else begins a new one; behind what is opaque it is lost. Returns the number
/// of splats that were drawn.
std::size_t draw_splats(LdiPixels const& pixels, std::size_t first, std::size_t count, SplatTransform const& transform,
                        OutputArea const& area);

/// Layers of pixels [begin, end) of a row, near to far, as sums of linear light and coverage (0 to 1), and the key of
/// the nearest that covers something. Two buffers may be composed as one (`more`, may be null).
struct ComposedPixel {
  float red, green, blue, coverage, key;
};
void compose_splats(OutputArea const& area, OutputArea const* more, int y, int begin, int end, ComposedPixel* out);

}  // namespace scanview
