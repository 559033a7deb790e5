#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "register/view_surface.h"

namespace scanview {

/// Points that can be recognised from another view.
struct Features {
  std::vector<Eigen::Vector3d> points, normals;  ///< camera coordinates
  cv::Mat descriptors;                           ///< a row of unit length a point
};

struct FeatureMatch {
  std::size_t a = 0, b = 0;
  float likeness = 0;  ///< product of the descriptors
};
/// Pairs of which each is among the `nearest` most alike features of the other.
std::vector<FeatureMatch> nearest_matches(Features const& a, Features const& b, int nearest);

/// SIFT features (Lowe 2004) of a view's colour, at pixels that lie on its surface.
/// `surface` is the view's finest level. No features without colour.
Features find_features(RangeImage const& image, ViewSurface const& surface);

struct FeatureMotionOptions {
  double threshold = 0;  ///< distance up to which two points coincide, units
  std::size_t min_inliers = 8;
  int trials = 1000;
  std::uint64_t seed = 1, item = 0;  ///< of the random samples
};

/// The rigid motion that carries most matched features of a onto those of b, by random samples of three (Fischler and
/// Bolles 1981; seeded) and least squares over the inliers.
struct FeatureMotion {
  bool found = false;
  Eigen::Isometry3d b_from_a = Eigen::Isometry3d::Identity();
  std::size_t matches = 0, inliers = 0;
  std::vector<Eigen::Vector3d> points;  ///< the inliers, in b's camera coordinates
};
FeatureMotion match_features(Features const& a, Features const& b, FeatureMotionOptions const& options);

/// Least-squares rotation and translation (no scale), b_from_a * from ~ to. At least three points that are not in line.
Eigen::Isometry3d fit_motion(std::vector<Eigen::Vector3d> const& from, std::vector<Eigen::Vector3d> const& to);

}  // namespace scanview
