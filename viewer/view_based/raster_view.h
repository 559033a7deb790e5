#pragma once
#include <Eigen/Geometry>

#include "acquire/scan_set.h"
#include "mesh/view_mesh.h"
#include "viewer/raster/triangle_bins.h"

namespace scanview {

/// A view as the rasteriser draws it.
class RasterView {
 public:
  /// `picture`: padded_texture() of the view.
  RasterView(View const& view, ViewMesh const& view_mesh, cv::Mat3b const& picture);
  RasterMesh const& mesh() const { return mesh_; }
  RasterTexture const& texture() const { return texture_; }
  Eigen::Vector3f const& gain() const { return gain_; }
  /// False where all of the view lies behind the camera.
  bool transform_to(Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                    ScreenTransform& transform) const;

 private:
  Camera camera_;
  Eigen::Isometry3d object_from_camera_;
  Eigen::Vector3f gain_;
  Eigen::AlignedBox3d bounds_;
  cv::Rect area_;
  RasterMesh mesh_;
  RasterTexture texture_;
};

}  // namespace scanview
