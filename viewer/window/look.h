#pragma once
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {

/// What a person can toggle about how views are mixed, as the panel shows it.
struct Look {
  bool collage = false;  ///< the nearest sample alone instead of a mixture
  bool soft_z = true;    ///< off: samples are averaged whatever their depths
  bool barycentric = true, cosine = true, feather = true;
  SoftZ::Show show = SoftZ::Show::picture;
  bool wireframe = false;
  double threshold = 0;  ///< units
  double reliability_ratio = 0.05;
  int fill_views = 6;
  bool operator==(Look const&) const = default;
};

/// The look that these options give; their threshold is a length (ViewBasedRenderer::options).
Look look_of(ViewBasedOptions const& options);
/// `options` with this look; views that are left out stay so.
ViewBasedOptions with_look(ViewBasedOptions options, Look const& look);

}  // namespace scanview
