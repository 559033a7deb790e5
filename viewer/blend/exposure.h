#pragma once
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"

namespace scanview {

struct ExposureOptions {
  /// Two depths of one surface may differ by so much, units. Negative: from the set's error budget, and where that
  /// knows nothing 1 % of the set's radius.
  double threshold = -1;
  /// How far from 1 a gain may go, either way.
  double greatest_gain = 4;
  /// automatic: the light that stands still with the camera is looked for too, and kept where it explains at least
  /// `least_explained` of the squared differences that gains leave; never: gains alone.
  enum class Light { automatic, never } light = Light::automatic;
  double least_explained = 0.05;
  void validate() const;
};

struct Exposure {
  std::vector<Eigen::Vector3d> gains;  ///< R, G, B of each view in linear light: View::gain
  std::optional<CameraLight> light;
  /// RMS difference of the views' logarithmic colours on the surfaces that they share (robust, over all channels): as
  /// they are, with gains, and with gains and light together (whether or not it was kept). NaN where nothing is shared.
  double rms_before = 0, rms_gains = 0, rms_light = 0;
};

/// What brings the views to one exposure: automatic exposure and white balance change between the shots, and where the
/// object turns before camera and lamps, so does the light on it. Unless taken care of, both are seen as seams.
///
/// Wherever two views see one surface (thinned), the logarithms of their colours differ by the difference of the views'
/// gains and of the light at the two normals (CameraLight). One robust least-squares problem (Cauchy weights, 0.1)
/// holds all of them, channel by channel, with a prior that counts like a hundredth of a view's samples towards gain 1
/// and no light. Pixels that are nearly dark or saturated are left out. The gains' mean logarithm, weighted by samples,
/// is 0 in every part of the set that hangs together; a view that overlaps with none keeps 1. Needs poses.
/// Pairs² · pixels / 16, at most some 400 000 samples.
Exposure estimate_exposure(ScanSet const& set, ExposureOptions const& options, Context& context);

}  // namespace scanview
