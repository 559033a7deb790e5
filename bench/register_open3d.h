#pragma once
#include <vector>

#include "acquire/scan_set.h"

namespace scanview {

/// Open3D's point-to-plane ICP with Tukey's loss, as a person would set it: every point, normals of 10 neighbours,
/// furthest correspondences 10, 3 and 0.8 % of the size, at most 50 iterations each, one thread. b_from_a.
Eigen::Isometry3d align_with_open3d(ScanSet const& set, Eigen::Isometry3d const& start, double size);

/// Open3D's multiway registration from the set's poses: such an edge for every two views that overlap there, with its
/// information matrix, then the pose graph with its line process. object_from_camera of every view.
std::vector<Eigen::Isometry3d> multiway_with_open3d(ScanSet const& set, double size);

}  // namespace scanview
