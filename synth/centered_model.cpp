#include "synth/centered_model.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace scanview {

using Eigen::Vector3d;

CenteredModel centered(TriangleMesh const& model) {
  Eigen::AlignedBox3d box;
  for (auto const& t : model.triangles)
    for (int c = 0; c < 3; ++c) box.extend(model.vertices[t[c]].cast<double>());
  if (box.isEmpty()) throw Error(ErrorCode::bad_input, {}, "the model has no triangles: nothing to scan");
  CenteredModel result;
  result.center = box.center();
  for (auto const& t : model.triangles)
    for (int c = 0; c < 3; ++c)
      result.radius = std::max(result.radius, (model.vertices[t[c]].cast<double>() - result.center).norm());
  if (!(result.radius > 0) || !std::isfinite(result.radius))
    throw Error(ErrorCode::bad_input, {}, "the model has no extent: nothing to scan");
  result.vertices.assign(model.vertices.size(), Eigen::Vector3f::Zero());
  for (auto const& t : model.triangles)
    for (int c = 0; c < 3; ++c)
      result.vertices[t[c]] = (model.vertices[t[c]].cast<double>() - result.center).cast<float>();
  return result;
}

double exact_distance(CenteredModel const& model, Eigen::Vector3i const& triangle, RayHit const& hit,
                      Vector3d const& origin, Vector3d const& direction) {
  auto const at = [&](int corner) -> Vector3d { return model.vertices[triangle[corner]].cast<double>(); };
  return exact_distance({at(0), at(1), at(2)}, hit, origin, direction, 1e-4 * (hit.distance + model.radius));
}

double exact_distance(std::array<Vector3d, 3> const& corners, RayHit const& hit, Vector3d const& origin,
                      Vector3d const& direction, double margin) {
  auto const& [a, b, c] = corners;
  Vector3d const normal = (b - a).cross(c - a);
  // A plane seen edge-on says nothing.
  double const exact = normal.dot(a - origin) / normal.dot(direction);
  return std::abs(exact - hit.distance) < margin ? exact : hit.distance;
}

Eigen::Isometry3d look_at(Vector3d const& eye, Vector3d const& target) {
  Vector3d const forward = (target - eye).normalized();
  Vector3d const up = std::abs(forward.y()) > 0.9999 ? Vector3d(0, 0, -1) : Vector3d(0, 1, 0);
  Vector3d const right = forward.cross(up).normalized();
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear().col(0) = right;
  pose.linear().col(1) = forward.cross(right);
  pose.linear().col(2) = forward;
  pose.translation() = eye;
  return pose;
}

}  // namespace scanview
