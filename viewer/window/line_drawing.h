#pragma once
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/camera.h"

namespace scanview {

/// Draws lines of a pixel's width over a picture of the camera's size, where nothing that is nearer hides them. depth:
/// of the same picture, z in the camera, NaN where there is nothing. A point of a line is seen if within a pixel of it
/// something lies as far away or farther, or nothing: so a silhouette is seen, whose own surface falls away beside it,
/// and a crease, whose surface was sampled at the pixels' centres.
///
/// lines: the vertices at both ends, in object coordinates. colors: BGRA of each line; none: opaque black. Linear in
/// the lines' pixels.
void draw_seen_lines(cv::Mat4b& picture, cv::Mat1f const& depth, Camera const& camera,
                     Eigen::Isometry3d const& object_from_camera, std::vector<Eigen::Vector3f> const& vertices,
                     std::vector<Eigen::Vector2i> const& lines, std::vector<cv::Vec4b> const& colors = {});

}  // namespace scanview
