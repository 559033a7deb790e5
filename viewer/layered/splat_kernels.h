#pragma once
#include <cstddef>
#include <cstdint>

#include "viewer/layered/ldi_pixels.h"

// Compiled once for each instruction set (Highway): includes neither Eigen nor OpenCV. All sets compute the same bits:
// no fused multiply-add, no approximate reciprocals.

namespace scanview {

/// One layer of an output pixel: sums of what was added to it, weighted, as one vector.
struct alignas(32) OutputLayer {
  enum Sum { red, green, blue, weight, key, kSums = 7 };
  /// Linear light, the weights themselves (1: covered once), and 1/z (perspective) or −z (orthographic).
  float sums[kSums];
  float tolerance;  ///< what other keys may differ by and be the same surface
};
static_assert(sizeof(OutputLayer) == 32);
inline constexpr int kOutputLayers = 4;

/// A part of the layered output buffer (Chang 1998, §3.2: "we implement the output buffer as an LDI"): for each pixel
/// up to kOutputLayers layers, near to far. Rows are `stride` pixels apart; the first is that of pixel (left, top).
/// Before and after each row there is a pixel that may be written to.
struct OutputArea {
  OutputLayer* layers[kOutputLayers];
  std::uint8_t* counts;         ///< of each pixel's layers
  std::uint8_t const* stencil;  ///< not null: only pixels where it is not 0 are drawn on; rows of right − left pixels
  int stride, left, top, right, bottom;
  int first_x, first_y, end_x, end_y;  ///< nothing is drawn outside of this part of it
};

/// From grid steps of a cell's face (x, y, depth in steps, 1) to u z, v z and z of the output's camera (perspective) or
/// u, v and z (orthographic).
struct SplatTransform {
  float rows[3][4];
  float depth_scale;  ///< steps in 1/65536 of the cell
  float facing;     ///< ±1: only surfaces whose grid turns that way on the screen; 0: all, as if they faced the camera
  float step;       ///< a grid step that faces the camera, in pixels (times z: perspective)
  float doubt;      ///< 0: normals are exact; 1: surfaces may be turned more to the camera than they say
  float tolerance;  ///< in units of depth
  float near;       ///< perspective: nothing nearer is drawn
  float deepest;    ///< orthographic: what the depths of a surface in a pixel may differ by
  float least, widest;  ///< reach of a splat, in pixels
  bool perspective;
  bool fills;  ///< a layer takes no more than what it lacks to be covered once
};

/// Draws pixels [first, first + count) of a cell. A splat is a bilinear kernel as wide as the grid is on the screen
/// there; its depth follows its tangent plane. A sample is added to the layer whose depth is its own within the greater
/// of their tolerances, else begins a new one; behind what is opaque it is lost. Returns the number of splats that were
/// drawn.
std::size_t draw_splats(LdiPixels const& pixels, std::size_t first, std::size_t count, SplatTransform const& transform,
                        OutputArea const& area);

/// What a row of the picture is written to; one element a pixel.
struct PictureRow {
  std::uint32_t* color;  ///< BGRA, straight alpha
  float* depth;
};
/// Composes the layers of pixels [begin, end) of row y from the front: layers that are opaque together hide the rest;
/// depth is that of the one which shows most. Two buffers may be composed as one (`more`, may be null). Pixels without
/// layers get color 0 and depth NaN; with the area's stencil only where it is not 0 anything is written. Returns the
/// number of pixels whose alpha is less than `least_alpha`, of those written.
std::size_t compose_splats(OutputArea const& area, OutputArea const* more, int y, int begin, int end, bool perspective,
                           std::uint32_t least_alpha, PictureRow const& out);

}  // namespace scanview
