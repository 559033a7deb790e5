#pragma once
#include <Eigen/Geometry>
#include <opencv2/core/types.hpp>

#include "calib/camera.h"
#include "viewer/raster/raster_types.h"

namespace scanview {

/// Rows of the homogeneous coordinates (u w, v w, w) of a point in camera coordinates, in pixels: those of an area of
/// the picture that starts at pixel (x, y), whose corner has (0, 0) (a pixel's centre lies at half a pixel). w is z of
/// a perspective camera and 1 of an orthographic one (Darsa 1998, appendix).
Eigen::Matrix<double, 3, 4> picture_from_camera(Camera const& camera, int x = 0, int y = 0);

struct DepthRange {
  double near = 0, far = 0;
};
/// Of a box (in a source camera's coordinates) as another camera sees it, with a small margin; near is at least a
/// ten-thousandth of far for a perspective camera: what is nearer would be magnified beyond any meaning. False where
/// all of it is behind a perspective camera.
bool depth_range(Eigen::AlignedBox3d const& bounds, Eigen::Isometry3d const& camera_from_source, bool perspective,
                 DepthRange& range);

/// Where a view's picture shows what pixel (x, y) of another camera sees at depth z: texel (s w, t w, w) =
/// z · along (x, y, 1) + at (x, y, 1), in texels of `area`.
struct PicturePlace {
  Eigen::Matrix3f along, at;
};
PicturePlace picture_place(Camera const& source, cv::Rect const& area, Eigen::Isometry3d const& source_from_camera,
                           Camera const& camera);

/// For the rasteriser: positions and depths of what a camera sees, without texture coordinates.
ScreenTransform screen_transform(Camera const& camera, Eigen::Isometry3d const& camera_from_source,
                                 DepthRange const& range);

}  // namespace scanview
