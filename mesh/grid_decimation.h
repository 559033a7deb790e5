#pragma once
#include "mesh/depth_field.h"
#include "mesh/depth_triangulation.h"

namespace scanview {

/// Decimates a triangulation that follows every pixel: edges collapse in the order of the cost of Lindstrom and Turk
/// (1998; CGAL's edge collapse), each to the place that keeps volume and border best, as long as all triangles keep
/// their turn in the picture, its border stays, and no pixel is more than `limit` tolerances off, until `max_triangles`
/// are left (0: as few as the limit allows). Slow, a hundred times insert_greedily(): the reference for the other ways
/// to place vertices.
DepthTriangulation decimate_grid(DepthTriangulation const& grid, DepthField const& field, Camera const& camera,
                                 double limit, int max_triangles);

}  // namespace scanview
