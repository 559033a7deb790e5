#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "mesh/triangle_mesh.h"
#include "viewer/visibility/sample_camera.h"
#include "viewer/visibility/visibility_kernels.h"

namespace scanview {

/// Where an eye is, as the planes see it: a point (w = 1) or a direction to something infinitely far (w = 0), in radii
/// from the model's centre.
struct EyePoint {
  float x = 0, y = 0, z = 0, w = 1;
};

/// The planes of a mesh's triangles, a component an array, padded for whole vectors; in radii from the centre. Of
/// triangles without area all four are 0.
struct TrianglePlanes {
  std::vector<float> x, y, z, offset;

  Eigen::Vector3d center;
  double radius;

  TrianglePlanes(TriangleMesh const& mesh, Eigen::Vector3d const& center, double radius);
  FacingPlanes arrays() const { return {x.data(), y.data(), z.data(), offset.data()}; }
  EyePoint eye(Eigen::Vector3d const& eye) const;
  EyePoint eye(SampleCamera const& camera) const;
  /// n · eye − offset: above 0 where the eye is before the triangle's front.
  float height(std::size_t i, EyePoint const& eye) const {
    return x[i] * eye.x + y[i] * eye.y + z[i] * eye.z - offset[i] * eye.w;
  }
  /// Of the angle between the normal and the line of sight to about the triangle (up to the model's extent).
  float cosine(std::size_t i, EyePoint const& eye) const;
};

}  // namespace scanview
