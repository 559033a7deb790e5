#pragma once
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "acquire/scan_set.h"
#include "mesh/view_mesh.h"
#include "viewer/raster/triangle_bins.h"
#include "viewer/view_based/view_library.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {

/// A view as the rasteriser draws it.
class RasterView {
 public:
  /// `picture`: padded_texture() of the view.
  RasterView(View const& view, ViewMesh const& view_mesh, cv::Mat3b const& picture,
             std::optional<CameraLight> const& light);
  RasterMesh const& mesh() const { return mesh_; }
  RasterTexture const& texture() const { return texture_; }
  Eigen::Vector3f const& gain() const { return gain_; }
  /// False where all of the view lies behind the camera. `spacing`: typical angle between neighbouring views, radians
  /// (infinite: all directions are alike); `relight`: as far as there is a CameraLight.
  bool transform_to(Camera const& camera, Eigen::Isometry3d const& object_from_camera, double spacing, bool relight,
                    ScreenTransform& transform) const;
  PicturePlace place(Camera const& camera, Eigen::Isometry3d const& object_from_camera) const {
    return picture_place(camera_, area_, object_from_camera_.inverse() * object_from_camera, camera);
  }

 private:
  Camera camera_;
  Eigen::Isometry3d object_from_camera_;
  Eigen::Vector3f gain_;
  Eigen::AlignedBox3d bounds_;
  std::optional<CameraLight> light_;
  cv::Rect area_;
  RasterMesh mesh_;
  RasterTexture texture_;
};

/// The views of a library as the rasteriser draws them, made when they are first asked for.
class RasterViews {
 public:
  explicit RasterViews(std::shared_ptr<ViewLibrary> library);
  /// Null where the picture failed or, unless `wait`, is not there yet.
  RasterView const* get(std::size_t view, bool wait);

 private:
  std::shared_ptr<ViewLibrary> library_;
  std::vector<std::optional<RasterView>> views_;
};

}  // namespace scanview
