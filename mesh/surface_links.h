#pragma once
#include <cstddef>
#include <opencv2/core/mat.hpp>

#include "acquire/range_image.h"

namespace scanview {

/// What is linear over the picture of a plane: 1/z under perspective, z in an orthographic image. The map is its own
/// inverse.
inline double linear_depth(Camera const& camera, double z) { return camera.is_perspective() ? 1.0 / z : z; }

/// Which neighbouring pixels are on one surface. All CV_8U, of the image's size, 0 or 1.
struct SurfaceLinks {
  cv::Mat1b object;         ///< has a depth and belongs to a patch that is large enough
  cv::Mat1b right;          ///< (x, y) and (x + 1, y) are on one surface
  cv::Mat1b down;           ///< (x, y) and (x, y + 1) are on one surface
  std::size_t dropped = 0;  ///< pixels with a depth in patches that were too small

  bool is_object(int x, int y) const {
    return x >= 0 && y >= 0 && x < object.cols && y < object.rows && object(y, x) != 0;
  }
  /// Of two pixels that share a side.
  bool linked(int x0, int y0, int x1, int y1) const {
    if (y0 == y1) return right(y0, x0 < x1 ? x0 : x1) != 0;
    return down(y0 < y1 ? y0 : y1, x0) != 0;
  }
};

/// Two neighbours a, b with depths are on one surface where
///   |z_b − z_a| ≤ step_sigmas · √(σ_a² + σ_b²) + max(width of a pixel, slope).
/// The slope is what the surfaces on either side, continued by a pixel, make of the difference, linear in 1/z under
/// perspective, so that a plane at any angle has no step: twice the lesser of the two sides' (lines through up to three
/// pixels), or, of one side alone, what two successive differences both reach, which keeps steep crests and tips whole.
/// Pixels that fly between two surfaces have neither. A jump smaller than a pixel is wide can't be told from a slope
/// of 45°. A step of one pixel's length inside one surface is none. Patches (pixels that are linked, directly
/// or not) of fewer than `min_patch_pixels` are dropped. Linear in the number of pixels.
SurfaceLinks find_surface_links(RangeImage const& image, double step_sigmas, int min_patch_pixels);
/// Drops patches again, after links were cut.
void drop_small_patches(SurfaceLinks& links, int min_patch_pixels);

}  // namespace scanview
