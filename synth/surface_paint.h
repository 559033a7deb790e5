#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mesh/model_textures.h"
#include "synth/ray_scene.h"

namespace scanview {

/// The share of light that a model's surface sends back, linear R G B in [0, 1]: its texture where a
/// triangle has one (texture_lookup.h), else its colours, between the corners in proportion.
class SurfacePaint {
 public:
  /// All must outlive this; `colors` as in TriangleMesh, or empty for pale plaster.
  SurfacePaint(std::vector<Eigen::Vector3i> const& triangles, std::vector<cv::Vec3b> const& colors)
      : triangles_(triangles), colors_(colors) {}
  SurfacePaint(std::vector<Eigen::Vector3i> const& triangles, std::vector<cv::Vec3b> const& colors,
               ModelTextures const& textures)
      : triangles_(triangles), colors_(colors), textures_(&textures) {}

  Eigen::Vector3f at(RayHit const& hit) const;
  bool has_texture(int triangle) const { return textures_ && textures_->on(triangle); }
  /// Without textures.
  Eigen::Vector3f at_vertex(int vertex) const;

 private:
  std::vector<Eigen::Vector3i> const& triangles_;
  std::vector<cv::Vec3b> const& colors_;
  ModelTextures const* textures_ = nullptr;  // none: no triangle has one
};

}  // namespace scanview
