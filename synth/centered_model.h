#pragma once
#include <Eigen/Geometry>
#include <array>
#include <vector>

#include "mesh/triangle_mesh.h"
#include "synth/ray_scene.h"

namespace scanview {

/// A model around its own centre, so that single precision serves models far from the origin as well.
struct CenteredModel {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of the box around all triangles
  double radius = 0;                                 ///< of the sphere about the centre that holds them
  std::vector<Eigen::Vector3f> vertices;             ///< those that no triangle uses lie in the centre
};

/// Throws Error{bad_input} for a model without triangles or without any extent.
CenteredModel centered(TriangleMesh const& model);

/// The parameter at which the line origin + t direction meets the plane of the triangle it hit, in double precision
/// (single is what the ray caster gives: some 1e-6 of the distance). `origin` in the model's centred coordinates.
double exact_distance(CenteredModel const& model, Eigen::Vector3i const& triangle, RayHit const& hit,
                      Eigen::Vector3d const& origin, Eigen::Vector3d const& direction);

/// The same for a triangle's corners a, b, c. Where plane and `hit` are further than `margin` apart, or there is no
/// plane, the hit decides.
double exact_distance(std::array<Eigen::Vector3d, 3> const& corners, RayHit const& hit, Eigen::Vector3d const& origin,
                      Eigen::Vector3d const& direction, double margin);

/// A camera at `eye` that looks at `target`, its picture's upper side towards +y (towards -z when it looks down or up).
Eigen::Isometry3d look_at(Eigen::Vector3d const& eye, Eigen::Vector3d const& target);

}  // namespace scanview
