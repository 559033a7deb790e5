#pragma once
#include <vector>

#include "base/context.h"
#include "mesh/depth_field.h"
#include "mesh/depth_triangulation.h"

namespace scanview {

struct JointFitOptions {
  double limit = 1;   ///< tolerances that no error may exceed, unless its triangles' already did
  int sweeps = 2;     ///< over all edges and vertices
  bool fewer = true;  ///< join vertices where the limit allows; else the number of triangles stays
  /// A vertex is worth so much of the squared error, in tolerances: new ones are put where they lower it by more, and
  /// vertices are joined only where that costs less. 0: none is put, and what joining costs does not matter.
  double worth = 0;
  /// Greater than 0: new vertices, those first that lower the squares most, make no more triangles than this; once so
  /// many are there, vertices whose loss costs less than half of what others gain are exchanged for those.
  int max_triangles = 0;
};

/// Lowers the squared error of a triangulation by changing what is connected with what and where its vertices are, at
/// the same number of triangles or with fewer:
/// * edges are flipped (data-dependent triangulation: Dyn, Levin, Rippa 1990);
/// * vertices of the inside move along the ray and in the picture at once, a Gauss-Newton step each: with λ the
///   vertex's weight at a pixel and s the slope of the triangle there, the error falls by λ (dz − s · dp);
/// * vertices whose triangles can be spared are joined with a neighbour;
/// * depths are fitted again (fit_depths()).
/// A change counts only where it lowers the squares (joining: where it keeps the limit) and no error grows beyond the
/// limit or what was there; triangles keep their turn and do not become slivers (least height 0.7 pixels, or what was
/// there). `errors`: scan_errors() of the triangulation as it is; returns
/// them as it leaves it. About linear in the pixels, a sweep.
std::vector<TriangleError> fit_jointly(DepthTriangulation& triangulation, DepthField const& field,
                                       JointFitOptions const& options, std::vector<TriangleError> errors,
                                       Context& context);

}  // namespace scanview
