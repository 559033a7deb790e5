#pragma once
#include <string>

#include "acquire/capture.h"
#include "acquire/code_image.h"
#include "acquire/pixel_noise.h"
#include "acquire/soundness.h"
#include "base/context.h"

namespace scanview {

/// One camera's pictures of one view, decoded.
struct DecodedSide {
  CodeImage image;
  cv::Mat1i rows;     ///< of the projector; empty where there are no row bits
  cv::Mat1b centres;  ///< of stripes; empty but for the stripe decoder
  PixelNoise noise;
  double beam_sigma = 0;  ///< in light steps (sweep)
  SoundnessFigures soundness;
};

enum class SweepDecoder { space_time, stripe };

/// Streams the pictures of one camera through its decoder and the checks of soundness. Throws Error{bad_input} naming
/// the picture that is missing, damaged, of another size than the camera's or of another depth than those before it.
DecodedSide decode_side(Capture const& capture, std::string const& view, Side side, Camera const& camera,
                        SweepDecoder sweep_decoder, Context& context);

}  // namespace scanview
