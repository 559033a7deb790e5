#pragma once
#include "calib/stereo_rig.h"

namespace scanview {

/// Both cameras turned, in thought, until a row of one is the epipolar line of the same row of the other: x along the
/// baseline from left to right, z as near as can be to both optical axes. Disparity x_left - x_right (at the same focal
/// length, about the principal point) is then positive and depth = focal * baseline / disparity.
struct Rectification {
  Eigen::Matrix3d rectified_from_left, rectified_from_right;
  Camera left, right;  ///< ideal, rectified, large enough for all that each camera sees; same f and cy, rows are shared
  double baseline = 0;
};

/// Throws Error{no_solution} where one camera sees the other's centre, or nearly: rows would converge to a point, and
/// the light moves along them.
Rectification rectify(StereoRig const& rig);

/// For every pixel of an ideal camera that is turned against a real one, where that direction is in the real one's
/// picture; NaN where it is behind it. Exact at every fourth pixel, bilinear between: off by less than 2 px divided
/// by the focal length in pixels.
cv::Mat2f picture_map(Camera const& target, Eigen::Matrix3d const& target_from_camera, LensCamera const& camera);

}  // namespace scanview
