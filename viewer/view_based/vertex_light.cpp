#include "viewer/view_based/vertex_light.h"

#include <Eigen/Geometry>

namespace scanview {
namespace {

/// Depth noise tilts single triangles; light varies slowly.
constexpr int kSmoothings = 3;

}  // namespace

VertexLight vertex_light(TriangleMesh const& mesh, CameraLight const& light) {
  using Eigen::Vector3f;
  std::vector<Vector3f> normals(mesh.vertices.size(), Vector3f::Zero());
  auto const at = [](auto& values, int i) -> auto& { return values[static_cast<std::size_t>(i)]; };
  for (auto const& t : mesh.triangles) {
    Vector3f const a = at(mesh.vertices, t[0]);
    Vector3f const normal = (at(mesh.vertices, t[1]) - a).cross(at(mesh.vertices, t[2]) - a);
    for (int k = 0; k < 3; ++k) at(normals, t[k]) += normal;  // twice the area long
  }
  for (int round = 0; round < kSmoothings; ++round) {
    std::vector<Vector3f> sums = normals;
    for (auto const& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) at(sums, t[k]) += 0.5F * (at(normals, t[(k + 1) % 3]) + at(normals, t[(k + 2) % 3]));
    }
    normals = std::move(sums);
  }
  VertexLight result;
  for (auto& normal : normals) {
    float const length = normal.norm();
    result.normals.push_back(length > 0 ? Vector3f(normal / length) : Vector3f(0, 0, -1));
    result.logarithms.push_back(light.logarithm(result.normals.back().cast<double>()).cast<float>());
  }
  return result;
}

}  // namespace scanview
