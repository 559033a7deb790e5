#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>

#include "base/files.h"
#include "calib/camera.h"

namespace scanview {

/// Brown-Conrady distortion in OpenCV's order. Exists only on the way in: everything downstream of acquire/ sees ideal
/// pictures.
struct Lens {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0;

  bool is_ideal() const { return k1 == 0 && k2 == 0 && p1 == 0 && p2 == 0 && k3 == 0; }
  /// Distorted from ideal normalised coordinates (x/z, y/z).
  Eigen::Vector2d distort(Eigen::Vector2d const& ideal) const;
  /// [k1, k2, p1, p2] or [k1, k2, p1, p2, k3]; throws Error{bad_input, path}.
  static Lens from_json(Json const& json, std::filesystem::path const& path);
};

/// A colour picture as the ideal camera would have taken it (bilinear; black outside).
cv::Mat undistort_color(cv::Mat const& picture, Camera const& camera, Lens const& lens);
/// A depth map likewise, nearest neighbour, so that no depth is invented between surfaces; NaN outside.
cv::Mat1f undistort_depth(cv::Mat1f const& depth, Camera const& camera, Lens const& lens);

}  // namespace scanview
