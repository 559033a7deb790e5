#include "mesh/triangle_mesh.h"

#include <stdexcept>

namespace scanview {

void TriangleMesh::check() const {
  for (Eigen::Vector3f const& vertex : vertices)
    if (!vertex.allFinite()) throw std::logic_error("a mesh with a vertex that is not finite");
  int const count = int(vertices.size());
  for (Eigen::Vector3i const& triangle : triangles)
    if (triangle.minCoeff() < 0 || triangle.maxCoeff() >= count)
      throw std::logic_error("a mesh with a triangle whose vertex is not there");
  if (!colors.empty() && colors.size() != vertices.size())
    throw std::logic_error("a mesh whose colours are not one a vertex");
}

}  // namespace scanview
