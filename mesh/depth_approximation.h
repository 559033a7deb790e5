#pragma once
#include "base/context.h"
#include "mesh/depth_triangulation.h"
#include "mesh/outline.h"
#include "mesh/surface_links.h"
#include "mesh/view_mesh.h"

namespace scanview {

struct DepthApproximation {
  DepthTriangulation triangulation;  ///< of vertices that single precision holds exactly
  double tolerance = 0;              ///< kept: in units (Tolerance::units), or multiples of sigma
};

/// A range image as a triangulation inside its outline: vertices placed and fitted as the options say, then rounded to
/// single precision and mended where rounding took a pixel out of tolerance, so that what is written keeps it.
DepthApproximation approximate_depths(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                                      MeshOptions const& options, Context& context);

}  // namespace scanview
