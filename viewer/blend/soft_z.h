#pragma once
#include <Eigen/Core>
#include <vector>

namespace scanview {

/// What a whole layer (a view drawn from the eye) counts: in the mixture, and where the mixture has no good sample
/// (UsedView). `hue`: its false colour, linear light.
struct LayerWeight {
  double weight = 0;
  double fill = 0;
  Eigen::Vector3f hue{1, 1, 1};
};

/// Which of several views' samples of a pixel are seen, and how they are mixed (Pulli 1997, soft z-buffering). Two back
/// ends compute it: SoftZCompositor on OpenGL, the bands of viewer/raster.
///
/// Sample i has depth z and weight w = (weight + s · fill) · q, with q the pixel's weight w_cos · w_feather. s is 1
/// where the views with weight have no sample, and falls to 0 where sum(weight · min(1, 0.35 + q / 0.1)) reaches 0.3:
/// views that fill leave no ghosts where they are not needed, fade in towards the rim of a hole, and never touch a view
/// that has all the weight.
///
/// With hide(d) rising from 0 at d = threshold to 1 at d = 1.5 threshold:
///   reliable(i) = 1 − max over j of hide(z_j − z_i) · low(w_i / (ratio · w_j)), low falling from 1 at ½ to 0 at 1:
///                 a low-weight sample in front of a much heavier one further behind is ignored;
///   visible(k)  = 1 − max over i of reliable(i) · hide(z_k − z_i): what lies behind a reliable sample is hidden;
///   colour      = mean of all samples with weight w · reliable · visible.
/// With all transitions hard this is the paper's "nearest reliable depth, and everything within the threshold of it";
/// with them nothing switches when the eye or a weight moves a little. The furthest sample is always reliable and the
/// nearest reliable one always visible, so a pixel with a sample of positive weight gets a colour.
struct SoftZ {
  static constexpr int kMaxLayers = 24;
  static constexpr double kGoodEnough = 0.3;      ///< where the main views' goodness reaches it, nothing fills
  static constexpr double kGoodAtZero = 0.35;     ///< goodness of a sample with q = 0
  static constexpr double kGoodQuality = 0.1;     ///< q that adds 1 to it
  static constexpr double kFairQuality = 0.03;    ///< what only fills counts from this q on, fully from twice as much:
                                                  ///< the last fringe of a mesh hangs from the true outline
  double threshold = 0;                           ///< >= 0, may be infinite
  double reliability_ratio = 0.1;
  bool nearest = false;  ///< the nearest sample alone, whatever its weight
  enum class Show { picture, weights, winner } show = Show::picture;
};

}  // namespace scanview
