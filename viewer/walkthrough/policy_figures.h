#pragma once
#include <cstddef>
#include <vector>

#include "base/context.h"
#include "viewer/select/camera_path.h"
#include "viewer/walkthrough/walkthrough_renderer.h"

namespace scanview {

/// What a frame should look like: ray traced, or photographed.
struct ReferenceFrame {
  PathCamera from;
  cv::Mat3b picture;
  cv::Mat1b counts;  ///< pixels that are compared: not 0; empty: all
};

/// What one way to merge nodes makes of a sequence of frames (Darsa 1998, §7, figures 23 and 24).
struct PolicyFigures {
  MergePolicy policy = MergePolicy::positional;
  /// A frame: mean over pixels and R, G, B of the squared difference, channels from 0 to 1; uncovered pixels are black.
  std::vector<double> error;
  std::vector<double> milliseconds;  ///< a frame, of one sample a pixel, the faster of two
  std::vector<double> uncovered;     ///< a frame: share of the pixels that count
  double mean_error() const;
  double psnr() const;  ///< dB, of the mean error
  double median_milliseconds() const;
};

/// Draws all frames with each policy. Of `samples_side`² samples a pixel the mean in linear light is compared; times
/// are of one. Coverage is that of the centres.
std::vector<PolicyFigures> measure_policies(WalkthroughRenderer& renderer, std::vector<ReferenceFrame> const& frames,
                                            std::vector<MergePolicy> const& policies, int samples_side,
                                            Context& context);

}  // namespace scanview
