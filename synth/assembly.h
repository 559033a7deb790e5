#pragma once
#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "base/context.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// One of the solids that a procedural object is put together from.
struct Solid {
  Eigen::Vector3f center;  ///< of a sphere that holds it
  float radius;
  std::function<float(Eigen::Vector3f const&)> distance;         ///< signed, as polygonise asks for it
  std::function<Eigen::Vector3f(Eigen::Vector3f const&)> paint;  ///< sRGB colour (paint.h) of a point on its surface
};

/// The union of the solids as one closed mesh with a colour a vertex: that of the solid whose surface is nearest, the
/// first of equals. Only solids whose sphere is near are evaluated. `box`, `spacing` and `slack` as in polygonise.
TriangleMesh make_assembly(std::vector<Solid> const& solids, Eigen::AlignedBox3f const& box, float spacing, float slack,
                           Context& context);

}  // namespace scanview
