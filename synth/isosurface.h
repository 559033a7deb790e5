#pragma once
#include <Eigen/Geometry>
#include <functional>

#include "base/context.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// Triangles of the surface where `distance` is 0, by surface nets (Gibson 1998): a vertex in each grid cell that the
/// surface crosses, moved onto the surface along the gradient, and a quadrilateral around each grid edge that it
/// crosses. The result is closed (each edge is shared by an even number of triangles), oriented outwards, and has
/// about 3 · area / spacing² triangles.
///
/// `distance` is negative inside, never more than `slack` times the true distance (a smooth union, an approximate
/// ellipsoid), and positive on the border of `box`, which must hold the whole surface. It is called from several
/// threads. Only blocks of the grid that can hold surface are evaluated.
TriangleMesh polygonise(std::function<float(Eigen::Vector3f const&)> const& distance, Eigen::AlignedBox3f const& box,
                        float spacing, float slack, Context& context);

}  // namespace scanview
