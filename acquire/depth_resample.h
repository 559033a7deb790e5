#pragma once
#include <Eigen/Geometry>
#include <functional>
#include <opencv2/core/mat.hpp>

#include "acquire/depth_noise.h"
#include "calib/camera.h"

namespace scanview {

/// Depth as `camera` sees a surface that is known as a grid of points: CV_64FC3 in the camera's coordinates, NaN where
/// a point is missing. Neighbours in the grid are joined to triangles where `connected` says of all three sides that
/// they lie on one surface, and the triangles are rasterised with a z-buffer, so that the picture has no holes however
/// much finer it is, and what is hidden stays hidden. NaN where no triangle falls. Points behind a perspective camera
/// are left out. Cost: linear in points and in the pixels the triangles cover.
cv::Mat1f resample_depth(cv::Mat3d const& points, Camera const& camera,
                         std::function<bool(Eigen::Vector3d const&, Eigen::Vector3d const&)> const& connected);

/// A depth map of `source` as `target` sees it; surfaces end at depth steps (largest_step with the sensor's
/// noise). target_from_source carries points of the one camera to the other.
cv::Mat1f reproject_depth(cv::Mat1f const& depth, Camera const& source, Camera const& target,
                          Eigen::Isometry3d const& target_from_source, DepthNoise const& noise);

/// Closes gaps one pixel wide between depths of one surface (largest_step with the sensor's noise): the seams that
/// remain where a sensor's own software warped a coarser depth map into the colour picture point by point. 1/z is
/// interpolated.
void close_seams(cv::Mat1f& depth, Camera const& camera, DepthNoise const& noise);

}  // namespace scanview
