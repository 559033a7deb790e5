#pragma once
#include "mesh/depth_triangulation.h"
#include "mesh/outline.h"
#include "mesh/surface_links.h"

namespace scanview {

/// The object's part of the constrained Delaunay triangulation (CGAL, exact predicates) of an outline: no vertices yet
/// but the outline's. Each side of a step edge has its own, whose depth is continued from the pixels on that side
/// (fit_local_surface()), at most as far as the neighbouring depths differ. `tolerance`: depth, a pixel.
DepthTriangulation triangulate_outline(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                                       cv::Mat1f const& tolerance);

}  // namespace scanview
