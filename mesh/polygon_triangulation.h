#pragma once
#include <Eigen/Core>
#include <vector>

namespace scanview {

/// A polygon of n ≥ 3 corners in n − 2 triangles of corner numbers that turn as it does. Seen along its mean normal
/// (Newell), a polygon without a reflex corner becomes a fan about the first; from others ears are cut off (Meisters
/// 1975). One that crosses itself, or that would take more than about a thousand tests a corner, becomes a fan as well.
std::vector<Eigen::Vector3i> triangulate_polygon(std::vector<Eigen::Vector3d> const& corners);

}  // namespace scanview
