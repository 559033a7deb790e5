#pragma once
#include <Eigen/Core>
#include <vector>

#include "calib/camera.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// Halves edges until plain texture coordinates, interpolated linearly over each 3-D triangle, are nowhere more than
/// `tolerance_px` pixels from the projective ones. An edge of L pixels whose ends have depths z and r z, r ≥ 1, is off
/// by at most L (√r − 1)/(√r + 1), and a point inside a triangle by at most two edges' errors. Shared edges are halved
/// on both sides, so that no cracks open; halves lie on the old triangle to single precision. An orthographic camera
/// needs no splits. Linear in the number of triangles made.
TriangleMesh split_for_plain_texture(Camera const& camera, TriangleMesh const& mesh, double tolerance_px);

}  // namespace scanview
