#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "synth/ray_scene.h"

namespace scanview {

/// The share of light that a model's surface sends back, linear R G B in [0, 1]: its colours as they are, between the
/// corners of a triangle in proportion.
class SurfacePaint {
 public:
  /// Both must outlive this; `colors` as in TriangleMesh, or empty for pale plaster.
  SurfacePaint(std::vector<Eigen::Vector3i> const& triangles, std::vector<cv::Vec3b> const& colors)
      : triangles_(triangles), colors_(colors) {}

  Eigen::Vector3f at(RayHit const& hit) const;
  Eigen::Vector3f at_vertex(int vertex) const;

 private:
  std::vector<Eigen::Vector3i> const& triangles_;
  std::vector<cv::Vec3b> const& colors_;
};

}  // namespace scanview
