#pragma once
#include "acquire/range_image.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// The full grid of a depth map as peers take it: a vertex a pixel, two triangles between four, in the camera's
/// coordinates.
TriangleMesh full_grid(RangeImage const& image);

enum class MeshPeer { lindstrom_turk, garland_heckbert, meshoptimizer };
/// Simplifies a mesh to at most `triangles` by CGAL's edge collapse or by meshoptimizer, with their own settings.
/// Throws std::runtime_error for meshoptimizer where it is not installed.
TriangleMesh simplify_with_peer(MeshPeer peer, TriangleMesh const& mesh, int triangles);

}  // namespace scanview
