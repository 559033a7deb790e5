#pragma once
#include <vector>

#include "mesh/depth_field.h"
#include "mesh/depth_triangulation.h"

namespace scanview {

/// Errors of all triangles, by index; those that were removed have none.
std::vector<TriangleError> scan_errors(DepthTriangulation const& triangulation, DepthField const& field);

/// Gives all vertices that are not held the depths that least squares ask for: of the errors, in tolerances, at all
/// pixels (sparse, symmetric, linear; Cholesky). A vertex that hardly any pixel sees stays near its depth, as if a
/// twentieth of a pixel held it there, so that no fin grows between pixels.
///
/// No error grows beyond `limit` tolerances, or beyond what was its triangle's greatest where that was more: vertices
/// of triangles that least squares alone would take there go back half or all of their way. `errors`: scan_errors() of
/// the triangulation as it is; returns them as it leaves it. Linear in the pixels, about n^1.5 in the vertices.
std::vector<TriangleError> fit_depths(DepthTriangulation& triangulation, DepthField const& field, double limit,
                                      std::vector<TriangleError> errors);

}  // namespace scanview
