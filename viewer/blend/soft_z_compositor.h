#pragma once
#include <vector>

#include "viewer/blend/layer_targets.h"
#include "viewer/renderer.h"

namespace scanview {

/// What a whole layer counts: in the mixture, and where the mixture has no good sample (UsedView).
struct LayerWeight {
  double weight = 0;
  double fill = 0;
};

/// Which of several views' samples of a pixel are seen, and how they are mixed (Pulli 1997, soft z-buffering).
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
class SoftZCompositor {
 public:
  static constexpr int kMaxLayers = 24;

  explicit SoftZCompositor(GlFunctions const& gl);
  /// `weights`: one of each layer that was drawn, at most kMaxLayers. threshold >= 0, may be infinite.
  Frame compose(LayerTargets const& layers, std::vector<LayerWeight> const& weights, double threshold,
                double reliability_ratio);

 private:
  void resize(int width, int height);

  GlFunctions const& gl_;
  GlProgram program_;
  GlVertexArray no_vertices_;
  GlFramebuffer framebuffer_;
  GlTexture color_, depth_;
  int width_ = 0, height_ = 0;
};

}  // namespace scanview
