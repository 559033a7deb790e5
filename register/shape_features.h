#pragma once
#include "register/feature_match.h"

namespace scanview {

struct ShapeFeatureOptions {
  double radius = 1;            ///< of the object, units
  double neighbourhood = 0.12;  ///< radii: what surrounds a point and is described
  std::size_t max_features = 1200, max_surface = 5000;
};

/// Points of a view with a description of the shape around each that is the same in any pose: FPFH (Rusu, Blodow and
/// Beetz 2009), the square root of its shares, so that products compare as Hellinger's distance does. The least
/// peculiar points, a third, are left out: what looks like everything else tells nothing.
Features find_shape_features(ViewSurface const& surface, ShapeFeatureOptions const& options);

}  // namespace scanview
