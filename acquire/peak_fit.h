#pragma once
#include "acquire/pixel_noise.h"

namespace scanview {

/// Brightness over time at one pixel, as samples at whole steps 0 .. count - 1.
struct PeakSamples {
  static constexpr int kMost = 16;
  float value[kMost];
  bool usable[kMost];  ///< not saturated, within the sweep
  int count = 0;
};

/// a + b exp(-(t - t0)² / (2 w²)).
struct Peak {
  double ambient = 0, height = 0, time = 0, width = 1;
  double time_sigma = 0;  ///< from the information matrix
  double chi_square = 0;  ///< sum of squared residuals over their variances
  int degrees_of_freedom = 0;
  bool converged = false;
  double leverage[PeakSamples::kMost];  ///< share of each sample's own residual that the fit took up, where asked for
};

/// What is known of the width beforehand: the same beam passes all pixels. It decides only where a peak is too narrow
/// to tell its own.
struct WidthPrior {
  double width = 1;
  double sigma = 1e3;  ///< large: nothing is known
};

enum class PeakDetail { without_leverage, with_leverage };

inline constexpr int kPeaksAtOnce = 8;

/// Maximum likelihood of the four parameters of `count` peaks (1 to kPeaksAtOnce) under the noise
/// (Levenberg-Marquardt; the variances are those of the model itself). All have as many samples. `start_time` is where
/// the greatest value is. A peak's result does not depend on those beside it, nor on the processor.
void fit_peaks(PeakSamples const* samples, int count, double start_time, PixelNoise const& noise,
               WidthPrior const& prior, Peak* peaks, PeakDetail detail = PeakDetail::without_leverage);
inline Peak fit_peak(PeakSamples const& samples, double start_time, PixelNoise const& noise, WidthPrior const& prior,
                     PeakDetail detail = PeakDetail::without_leverage) {
  Peak peak;
  fit_peaks(&samples, 1, start_time, noise, prior, &peak, detail);
  return peak;
}

}  // namespace scanview
