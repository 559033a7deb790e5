#pragma once
#include <array>
#include <opencv2/core/mat.hpp>

#include "synth/capture.h"

namespace scanview {

/// What the light of one pixel is without noise: ambient + height exp(-(t - time)² / (2 width²)), in levels of the
/// picture. 4 x 4 rays a pixel, as the synthetic camera has them; their beams' times spread, which widens the peak.
struct TrueSignal {
  double ambient = 0, height = 0, time = 0, width = 1;
  double albedo = 0;      ///< mean over the rays that meet the object
  bool is_whole = false;  ///< all rays meet the object, and the light reaches all
};

/// Of the pixel (x, y) of a real (distorted) picture.
TrueSignal true_signal(CaptureRig const& rig, int view, CaptureSide side, int x, int y);

/// Smallest standard deviation that any unbiased estimate of the peak's time can have (Cramér and Rao): the Fisher
/// information of all frames, all four unknown, variance of a sample = shot + read + quantisation (1/12). In steps.
double time_bound(TrueSignal const& signal, SensorOptions const& sensor, int frames);

/// What is true of one view, on the grid of the ideal left camera.
struct TrueView {
  cv::Mat1f depth;
  cv::Mat1b visible;     ///< 255: seen by both cameras and lit
  cv::Mat1b near_edge;   ///< 255: a depth step or an edge of reflectance within kAround pixels
  cv::Mat1b near_paint;  ///< 255: an edge of reflectance within kAround pixels
  cv::Mat1b is_even;     ///< 255: visible, and no step, crease or shadow within kAround pixels
  cv::Mat1f bound;       ///< of depth; NaN where not even
  /// The nearest pixel of each real picture, and the bound of its code; only where even.
  std::array<cv::Mat2i, 2> pixel;
  std::array<cv::Mat1f, 2> code_bound, code_light, code_center;
};
inline constexpr int kAround = 3;

/// The bound of depth: z Z / (f B) hypot(bound_left, bound_right) / |d code / dx_right|, with both cameras' codes from
/// one pixel each and the surface's own plane.
TrueView true_view(CaptureRig const& rig, int view, Context& context);

}  // namespace scanview
