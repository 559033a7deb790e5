#pragma once
#include <opencv2/core/mat.hpp>
#include <vector>

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
/// by the focal length in pixels. Places are made when they are asked for: kept for all pixels they would be the
/// largest thing in memory.
class PictureMap {
 public:
  PictureMap() = default;
  PictureMap(Camera const& target, Eigen::Matrix3d const& target_from_camera, LensCamera const& camera);
  cv::Size size() const { return size_; }
  cv::Vec2f at(int x, int y) const;
  /// The places of a whole row, `size().width` of them.
  void row(int y, std::vector<cv::Vec2f>& places) const;

 private:
  cv::Size size_;
  cv::Mat2f exact_;
};

}  // namespace scanview
