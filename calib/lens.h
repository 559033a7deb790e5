#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/files.h"
#include "calib/camera.h"

namespace scanview {

/// Brown-Conrady distortion in OpenCV's order; k4 to k6 are the denominator of its rational model, 0 elsewhere. Exists
/// only on the way in: everything downstream of acquire/ sees ideal pictures.
struct Lens {
  double k1 = 0, k2 = 0, p1 = 0, p2 = 0, k3 = 0, k4 = 0, k5 = 0, k6 = 0;

  bool is_ideal() const { return *this == Lens{}; }
  /// Distorted from ideal normalised coordinates (x/z, y/z).
  Eigen::Vector2d distort(Eigen::Vector2d const& ideal) const;
  /// The inverse, by Newton's method to about 1e-14; NaN where it has none near by (beyond the radius at which the
  /// model folds over).
  Eigen::Vector2d undistort(Eigen::Vector2d const& distorted) const;
  /// 4, 5 or 8 numbers in the order of the members; throws Error{bad_input, path}.
  static Lens from_values(std::vector<double> const& values, std::filesystem::path const& path);
  static Lens from_json(Json const& json, std::filesystem::path const& path);
  bool operator==(Lens const&) const = default;
};

/// A colour picture as the ideal camera would have taken it (bilinear; black outside).
cv::Mat undistort_color(cv::Mat const& picture, Camera const& camera, Lens const& lens);
/// A depth map likewise, nearest neighbour, so that no depth is invented between surfaces; NaN outside.
cv::Mat1f undistort_depth(cv::Mat1f const& depth, Camera const& camera, Lens const& lens);

}  // namespace scanview
