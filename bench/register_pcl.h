#pragma once
#include "acquire/scan_set.h"

namespace scanview {

enum class PclMethod { plane, gicp };

/// b_from_a of the two views of a set by PCL: every point, normals or covariances of 10 neighbours, furthest
/// correspondences 10, 3 and 0.8 % of the size, at most 50 iterations each.
Eigen::Isometry3d align_with_pcl(ScanSet const& set, Eigen::Isometry3d const& start, double size, PclMethod method);

}  // namespace scanview
