#pragma once
#include "acquire/range_image.h"

namespace scanview {

/// Gives small holes in a surface depths: groups (8 neighbours) of at most `most_pixels` pixels without depth, of any
/// class but background and cut, whose surrounding pixels all have depths that agree with one plane (linear in 1/z
/// under perspective) to `step_sigmas` of their sigma and a pixel's width, the measure of step edges. Their depth is
/// that plane's, their sigma ten times the greatest around, so that they hardly count. A scanner's lost pixels would
/// else each cost a ring of triangles, and be seen through. Linear in the number of pixels.
RangeImage fill_small_holes(RangeImage const& image, double step_sigmas, int most_pixels);

}  // namespace scanview
