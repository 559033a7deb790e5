#pragma once
#include <Eigen/Core>
#include <vector>

#include "base/context.h"
#include "synth/ray_scene.h"

namespace scanview {

/// Which triangles of a mesh an eye sees, by rays: those with a sample point that nothing hides, of `points` spread
/// over each in proportion to its area (R2 sequence, Roberts 2018). Either side counts. scene: of the same mesh. The
/// truth that visibility computed from pictures is held against: it knows no pixels.
std::vector<bool> visible_triangles(RayScene const& scene, std::vector<Eigen::Vector3f> const& vertices,
                                    std::vector<Eigen::Vector3i> const& triangles, Eigen::Vector3d const& eye,
                                    int points, Context& context);

}  // namespace scanview
