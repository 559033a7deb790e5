#pragma once
#include <Eigen/Core>

#include "mesh/surface_links.h"

namespace scanview {

/// The surface at a pixel, in linear depth (linear_depth() of mesh/surface_links.h).
struct LocalSurface {
  double depth = 0;             ///< linear depth of a vertex put at the pixel
  Eigen::Vector2d slope{0, 0};  ///< change of linear depth a pixel
  double reach = 0;             ///< greatest difference to a neighbour on the same surface
};

/// Fits a plane to the pixels within two of (x, y) that can be reached over links. The depth is the plane's where the
/// pixels agree with a plane to their sigma, so that no vertex follows noise; else the pixel's own. It moves by no more
/// than 0.95 of `tolerance` (in depth), which keeps the pixel itself in tolerance, and by half of it where the
/// tolerance is less than two sigma: there the plane's own error counts.
LocalSurface fit_local_surface(RangeImage const& image, SurfaceLinks const& links, int x, int y, double tolerance);

/// Linear depth at a place less than a pixel away from (x, y): along the slope, by no more than `reach`.
double extend(LocalSurface const& surface, Eigen::Vector2d const& offset);

}  // namespace scanview
