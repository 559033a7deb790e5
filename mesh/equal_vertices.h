#pragma once
#include <vector>

#include "mesh/polygon_model.h"

namespace scanview {

/// For every vertex the first one of exactly its position (itself where there is none before). Linear time.
std::vector<int> first_of_equals(std::vector<Eigen::Vector3f> const& vertices);

/// The model with one vertex a position, in the order of the first of each, and a note if there are fewer than before.
/// The triangles stay, those too that have lost a side.
PolygonModel join_equal_vertices(PolygonModel model);

}  // namespace scanview
