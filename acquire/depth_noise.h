#pragma once
#include <string>
#include <vector>

#include "acquire/range_image.h"
#include "acquire/scan_set.h"

namespace scanview {

/// How far a measured depth may be off: sigma(z) = scale * (constant + quadratic z^2), and never less than what the
/// steps of the stored value (`quantum`) hide. The square is triangulation's: z = f b / d, so a disparity error e gives
/// z^2 e / (f b) (Khoshelham and Elberink 2012, eq. 9, for structured light; the same for active stereo).
struct DepthNoise {
  double constant = 0;   ///< units
  double quadratic = 0;  ///< 1/units
  double quantum = 0;    ///< one step of the stored depth, units
  double scale = 1;      ///< estimated from the data

  /// One standard deviation at depth z; positive for any finite z where the model is not all zeros.
  double sigma(double z) const;
};

/// Structured light or active stereo (Kinect, RealSense). Quadratic term 2e-3 per metre: Khoshelham and Elberink give
/// 1.4e-3 for the Kinect; Intel's depth quality guide, z^2 * subpixel / (f b) with 0.08 px, 640 px and 50 mm, gives
/// 2.5e-3 for a D435. The constant, 0.1 mm, stands for what calibration leaves at close range. A set of arbitrary scale
/// has no such figures: there the model is a thousandth of `typical_depth`, scaled by the data like any other.
DepthNoise sensor_noise(Unit unit, double quantum, double typical_depth);

/// A laser triangulation scanner whose working volume is small against its distance: noise is constant, a fifth of the
/// spacing of its samples until the data say otherwise.
DepthNoise scanner_noise(double spacing);

/// How the depths scatter, measured on the data and relative to `noise`: planes are fitted to windows of 7x7 pixels
/// without a depth step; the result is the median, over windows of all images, of residual RMS / sigma. Curved surfaces
/// add to the residual, so the median, not the mean; smooth parts decide. Noise that is correlated over the window is
/// not seen. Limited to [1/4, 4]: the model's physics is trusted to that much. 1 where there are fewer than 100
/// windows. Cost: linear in pixels (every third window is looked at in either direction).
double estimate_noise_scale(std::vector<RangeImage const*> const& images, DepthNoise const& noise);

/// Fills image.sigma wherever there is a depth.
void apply_noise(RangeImage& image, DepthNoise const& noise);

/// The largest difference in depth between pixels `distance` apart that one surface explains: a slope of up to 80
/// degrees, and `sigmas` standard deviations of noise.
double largest_step(Camera const& camera, double z, double sigma_a, double sigma_b, double distance, double sigmas = 6);

}  // namespace scanview
