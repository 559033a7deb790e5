#pragma once
#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/context.h"
#include "mesh/outline.h"
#include "mesh/surface_links.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// Triangulates a range image by greedy insertion (Garland and Heckbert 1995, algorithm III): a constrained Delaunay
/// triangulation (CGAL, exact predicates) whose constraints are `outline`; of all pixels the one that is worst off, by
/// error over `tolerance` (depth, a pixel, positive), becomes a vertex, only the triangles around it are looked at
/// again, and so on until every pixel of `links.object` is within its tolerance, or the next vertex would make more
/// than `max_triangles` (0: no limit; the outline alone may need more).
///
/// Where the worst pixel lies near the outline beside a long edge of it, the outline gets a vertex there first, so that
/// the border's depths are followed and no sliver lies along it whose normal means nothing (an angle of more than 135
/// degrees at the pixel). The depth of a vertex in the picture is that of fit_local_surface(). A vertex on the outline
/// is extended by the slope of its side, at most as far as the neighbouring depths differ, one vertex for each side of
/// a step.
///
/// Depths are checked on the vertices as they are returned, in single precision: afterwards the error at every pixel
/// that is not itself a vertex is within tolerance, unless the limit was reached. Coordinates are the camera's;
/// triangles have their normal (b − a) × (c − a) towards the camera. About n log n for n pixels.
TriangleMesh triangulate_by_greedy_insertion(RangeImage const& image, SurfaceLinks const& links, Outline const& outline,
                                             cv::Mat1f const& tolerance, int max_triangles, Context& context);

}  // namespace scanview
