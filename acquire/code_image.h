#pragma once
#include <opencv2/core/mat.hpp>

#include "acquire/range_image.h"
#include "acquire/rectification.h"
#include "base/context.h"

namespace scanview {

/// What one camera says of the light, on the grid of its own (distorted) picture: the code of every pixel, the light
/// plane's number or the projector's column, a real number. Equal codes in two cameras saw the same sheet of light.
struct CodeImage {
  cv::Mat1f code;     ///< NaN where there is none
  cv::Mat1f sigma;    ///< one standard deviation of the code from the camera's noise; NaN likewise
  cv::Mat1f bias;     ///< what it may be off by besides: mixed surfaces, interpolation over a bend; NaN likewise
  cv::Mat1b classes;  ///< PixelClass: object where there is a code, else why there is none
  cv::Mat1b lit;      ///< what the light showed of the surface: brightness above the ambient's, scaled to 8 bits

  bool has_code(int x, int y) const { return classes(y, x) == static_cast<std::uint8_t>(PixelClass::object); }
};

/// Where neighbouring codes belong to one surface. `across` tells it of pixels (x, y) and (x + 1, y), `down` of (x, y)
/// and (x, y + 1). They do where the code changes little, or as it does beside: see link_codes.
struct CodeLinks {
  cv::Mat1b across, down;
  double slope = 0;  ///< median absolute change of the code from pixel to pixel, in the direction of faster change
  double across_change = 0, down_change = 0;  ///< size of the median change in each direction; noise cancels
};

/// A change between two neighbours is within one surface where it is at most `kGentle` times the median change plus
/// four standard deviations, or at most `kSteep` times and like (within half) the change on one of its sides.
CodeLinks link_codes(CodeImage const& image);

/// Notes in `bias` by how much codes may be off because a pixel shows more than one thing. Where paint changes from
/// side to side, the middle of its light is off the pixel's. At the rim of a surface a pixel shows less light than
/// those farther in let expect (by the last two, linearly), since part of it is another surface: where less than
/// `share` is left, that may be what is at the pixel's centre, and the code goes (several_peaks).
void judge_mixed(CodeImage& image, CodeLinks& links, double share);

/// |second difference| of the codes around pixel x of a line, beyond what noise explains: an interpolation over the
/// pixel is off by up to an eighth of it. 0 where a neighbour is missing.
float excess_bend(float const* code, float const* sigma, int x, int count);

/// The codes at other places: for every pixel of the result, `map` says where it lies in `image` (NaN: nowhere).
/// Bilinear between four pixels that are linked; else from the nearest pixel along the slope on the side that is
/// linked, so that codes of two surfaces never mix. The class is that of the nearest pixel. `lit` is left empty. With a
/// `step`, only every so many rows of the map, one below the other.
CodeImage resample(CodeImage const& image, CodeLinks const& links, PictureMap const& map, Context& context,
                   int step = 1);

}  // namespace scanview
