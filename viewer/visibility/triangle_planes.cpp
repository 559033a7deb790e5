#include "viewer/visibility/triangle_planes.h"

#include <Eigen/Geometry>
#include <cmath>

namespace scanview {

EyePoint TrianglePlanes::eye(Eigen::Vector3d const& eye) const {
  Eigen::Vector3f const e = ((eye - center) / radius).cast<float>();
  return {e.x(), e.y(), e.z(), 1};
}

EyePoint TrianglePlanes::eye(SampleCamera const& camera) const {
  if (camera.camera.is_perspective()) return eye(camera.object_from_camera.translation());
  Eigen::Vector3f const d = -camera.object_from_camera.linear().col(2).cast<float>();
  return {d.x(), d.y(), d.z(), 0};
}

TrianglePlanes::TrianglePlanes(TriangleMesh const& mesh, Eigen::Vector3d const& center, double radius)
    : center(center), radius(radius) {
  constexpr std::size_t kPadding = 16;
  for (auto* const array : {&x, &y, &z, &offset}) array->assign(mesh.triangles.size() + kPadding, 0.0F);
  for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
    auto const corner = [&](int k) -> Eigen::Vector3d {
      return (mesh.vertices[static_cast<std::size_t>(mesh.triangles[i][k])].cast<double>() - center) / radius;
    };
    Eigen::Vector3d const a = corner(0);
    Eigen::Vector3d const normal = (corner(1) - a).cross(corner(2) - a).stableNormalized();
    if (!normal.allFinite()) continue;
    x[i] = static_cast<float>(normal.x());
    y[i] = static_cast<float>(normal.y());
    z[i] = static_cast<float>(normal.z());
    offset[i] = static_cast<float>(normal.dot(a));
  }
}

float TrianglePlanes::cosine(std::size_t i, EyePoint const& eye) const {
  float const length = std::sqrt(eye.x * eye.x + eye.y * eye.y + eye.z * eye.z);
  return length > 0 ? height(i, eye) / length : 0;
}

}  // namespace scanview
