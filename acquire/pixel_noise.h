#pragma once
#include <vector>

namespace scanview {

/// Variance of a camera's pixel value (in its own levels, quantisation included): read + gain * value. Shot noise makes
/// the second part.
struct PixelNoise {
  double read = 1.0 / 12;
  double gain = 0;
  double variance(double value) const { return read + gain * (value > 0 ? value : 0); }
};

/// Collects residuals of known brightness and fits the noise to them.
class NoiseFit {
 public:
  /// Brightest value of the camera: 255 or 65535.
  explicit NoiseFit(double full_scale) : full_scale_(full_scale), bins_(kBins) {}
  /// |residual| whose variance is the noise's at this brightness. Beyond the full scale it is not taken.
  void add(double brightness, double residual);
  void add(NoiseFit const& other);
  /// Weighted least squares over bins of brightness; each bin's variance from its residuals up to three medians, so
  /// that outliers do not count. At least quantisation's 1/12; `otherwise` where there are fewer than 200 residuals.
  PixelNoise solve(PixelNoise const& otherwise = {}) const;

 private:
  static constexpr int kBins = 32;
  double full_scale_;
  std::vector<std::vector<float>> bins_;
};

}  // namespace scanview
