#pragma once
#include <Eigen/Core>
#include <string>

#include "viewer/layered/ldi_tree.h"

namespace scanview {

/// The boxes of a tree's cells from above (Chang 1998, figure 7), as SVG: a colour for each level, finer ones on top of
/// coarser ones; the reference views' eyes, and what they look at. `up`: the axis nearest to it points to whoever
/// looks.
std::string svg_octree(LdiTree const& tree, Eigen::Vector3d const& up);

}  // namespace scanview
