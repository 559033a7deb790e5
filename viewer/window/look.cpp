#include "viewer/window/look.h"

#include <cmath>
#include <limits>

namespace scanview {

Look look_of(ViewBasedOptions const& options) {
  Look look;
  look.collage = options.visibility == ViewBasedOptions::Visibility::nearest;
  look.soft_z = std::isfinite(options.threshold);
  look.barycentric = options.barycentric;
  look.cosine = options.cosine;
  look.feather = options.feather;
  look.show = options.show;
  look.wireframe = options.wireframe;
  look.threshold = look.soft_z ? options.threshold : 0;
  look.reliability_ratio = options.reliability_ratio;
  look.fill_views = options.fill_views;
  return look;
}

ViewBasedOptions with_look(ViewBasedOptions options, Look const& look) {
  options.visibility = look.collage ? ViewBasedOptions::Visibility::nearest : ViewBasedOptions::Visibility::soft_z;
  options.threshold = look.soft_z ? look.threshold : std::numeric_limits<double>::infinity();
  options.barycentric = look.barycentric;
  options.cosine = look.cosine;
  options.feather = look.feather;
  options.show = look.show;
  options.wireframe = look.wireframe;
  options.reliability_ratio = look.reliability_ratio;
  options.fill_views = look.fill_views;
  return options;
}

}  // namespace scanview
