#include "viewer/select/sphere_hull.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <algorithm>
#include <stdexcept>

namespace scanview {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Mesh = CGAL::Surface_mesh<Kernel::Point_3>;

}  // namespace

std::vector<Eigen::Vector3i> sphere_hull(std::vector<Eigen::Vector3d> const& points) {
  std::vector<std::pair<Kernel::Point_3, int>> index;
  std::vector<Kernel::Point_3> input;
  for (auto const& p : points) {
    input.emplace_back(p.x(), p.y(), p.z());
    index.emplace_back(input.back(), static_cast<int>(index.size()));
  }
  std::sort(index.begin(), index.end());
  Mesh hull;
  CGAL::convex_hull_3(input.begin(), input.end(), hull);
  if (hull.number_of_faces() < 4) throw std::logic_error("sphere_hull: the points lie in one plane");

  std::vector<Eigen::Vector3i> faces;
  for (auto const face : hull.faces()) {
    Eigen::Vector3i corners;
    int i = 0;
    for (auto const vertex : hull.vertices_around_face(hull.halfedge(face))) {
      auto const found = std::lower_bound(index.begin(), index.end(), std::make_pair(hull.point(vertex), -1));
      corners[i++] = found->second;
    }
    // Each face starts at its least corner, so that the order does not depend on CGAL's memory.
    int const first = static_cast<int>(std::min_element(corners.begin(), corners.end()) - corners.begin());
    faces.emplace_back(corners[first], corners[(first + 1) % 3], corners[(first + 2) % 3]);
  }
  std::sort(faces.begin(), faces.end(), [](Eigen::Vector3i const& a, Eigen::Vector3i const& b) {
    return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end());
  });
  return faces;
}

}  // namespace scanview
