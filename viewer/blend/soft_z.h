#pragma once
#include <Eigen/Core>
#include <vector>

namespace scanview {

/// What a whole layer (a view drawn from the eye) counts: in the mixture, where the mixture has no good sample
/// (UsedView), and where it is decided what hides what (fill_rank). `hue`: its false colour, linear light.
struct LayerWeight {
  double weight = 0;
  double fill = 0;
  double fill_rank = 0;
  Eigen::Vector3f hue{1, 1, 1};
};

/// Which of several views' samples of a pixel are seen, and how they are mixed (Pulli 1997, soft z-buffering, carried
/// on). Two back ends compute it: SoftZCompositor on OpenGL, the tiles of viewer/raster.
///
/// Sample i has depth z, quality q = w_cos · w_near · √w_feather (at least kLeastQuality) and fairness f, rising from 0
/// at a feather of kFairFeather to 1 at twice that: the last fringe of a mesh hangs from the true outline. w_near =
/// 1 / (1 + (θ / (kNearSpacings · spacing))²), θ the angle at the surface between the rays to the eye and to the view's
/// camera, spacing that of neighbouring views: seen from inside, directions from the centre say little. The root of the
/// feather (the paper's is linear) hides borders as well and wastes less of the views: + 0.1 to 0.5 dB on held-out
/// views. Its rank is r = (weight + fill_rank · f) · q. With hide(d) rising from 0 at d = threshold to 1 at d = 1.5
/// threshold:
///   reliable(i) = 1 − max over j of hide(z_j − z_i) · low(r_i / (ratio · r_j)), low falling from 1 at ½ to 0 at 1:
///                 a low-rank sample in front of a much higher one further behind is ignored;
///   seen(k)     = reliable(k) · (1 − max over i of reliable(i) · hide(z_k − z_i)): what lies behind a reliable sample
///                 is hidden.
/// The views with weight fall short by
///   need        = 1 − sum(weight · min(1, 0.35 + q / 0.1) · seen) / 0.3, between 0 and 1,
/// where they have no sample, or only ones behind something that they do not see; there others fill. Elsewhere they
/// still count a little (need is at least kAlways, less near a view, as fill_rank): more pictures average more noise.
///   colour      = mean with shares (weight + need · f · fill) · q · seen.
/// Views that fill leave no ghosts where they are not needed and fade in towards the rim of a hole. With all
/// transitions hard and nothing that fills this is the paper's "nearest reliable depth, and everything within the
/// threshold of it"; with them nothing switches when the eye or a weight moves a little. The furthest sample is always
/// reliable and the nearest reliable one always seen, so a pixel with a sample of positive rank gets a colour.
///
/// Colours are taken where each view's picture shows the point at the mean depth: one surface, less noisy than each
/// view's own, instead of as many as there are views.
struct SoftZ {
  static constexpr int kMaxLayers = 24;
  static constexpr double kGoodEnough = 0.3;    ///< where the main views' goodness reaches it, nothing fills
  static constexpr double kGoodAtZero = 0.35;   ///< goodness of a sample with q = 0
  static constexpr double kGoodQuality = 0.1;   ///< q that adds 1 to it
  static constexpr double kFairFeather = 0.02;  ///< what only fills counts from this feather on, fully from twice it
  static constexpr double kNearSpacings = 2;
  static constexpr double kAlways = 0.1;
  static constexpr double kLeastQuality = 1e-4;  ///< a view that is alone at its border still shows
  double threshold = 0;                          ///< >= 0, may be infinite
  double reliability_ratio = 0.05;
  double always = 0;     ///< need at least: kAlways · fill_rank
  bool nearest = false;  ///< the nearest sample alone, whatever its weight
  enum class Show { picture, weights, winner } show = Show::picture;
};

}  // namespace scanview
