#pragma once
#include <Eigen/Core>
#include <vector>

namespace scanview {

/// Faces of the convex hull of unit vectors, counter-clockwise seen from outside: the Delaunay triangulation of the
/// sphere. Coplanar faces are triangulated. The vectors must not all lie in one plane (throws std::logic_error), and be
/// distinct. n log n (CGAL, exact predicates).
std::vector<Eigen::Vector3i> sphere_hull(std::vector<Eigen::Vector3d> const& points);

}  // namespace scanview
