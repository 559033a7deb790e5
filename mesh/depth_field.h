#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "acquire/range_image.h"
#include "mesh/surface_links.h"

namespace scanview {

/// What a triangulation approximates: the linear depth of every pixel of the object and how much an error of it weighs.
struct DepthField {
  cv::Mat1f depth;   ///< linear depth; 0 beside the object
  cv::Mat1f weight;  ///< 1 / tolerance, in linear depth; 0 beside the object
  int width() const { return depth.cols; }
  int height() const { return depth.rows; }
};

/// `tolerance`: of the depth of a pixel, in units, positive. Where |linear depth − field's| · weight ≤ 1 the depth is
/// within tolerance: under perspective the limit towards the far side, the narrower of the two, d (d + t) / t of
/// linear depth, counts on both.
DepthField make_depth_field(RangeImage const& image, SurfaceLinks const& links, cv::Mat1f const& tolerance);

/// The same where `tolerance` is of linear depth: |linear depth − field's| · weight ≤ 1 within it.
DepthField make_linear_depth_field(RangeImage const& image, SurfaceLinks const& links, cv::Mat1f const& tolerance);

/// A plane over the picture in linear depth: depth + slope · (p − origin).
struct DepthPlane {
  Eigen::Vector2d origin{0, 0};
  double depth = 0;
  Eigen::Vector2d slope{0, 0};
  double at(Eigen::Vector2d const& p) const { return depth + slope.dot(p - origin); }
};

/// A triangle over the picture: corners in pixels, their linear depths, and the plane through them.
struct DepthTriangle {
  Eigen::Vector2d corner[3];
  double depth[3];
  /// Twice the area; positive where the corners turn from x to y.
  double turn() const {
    Eigen::Vector2d const u = corner[1] - corner[0], v = corner[2] - corner[0];
    return u.x() * v.y() - u.y() * v.x();
  }
  DepthPlane plane() const;
  /// Slope over the picture of the weight of corner i (1 there, 0 at the others).
  Eigen::Vector2d barycentric_slope(int i) const;
};

/// Errors of a triangle over the pixels whose centres it holds, in tolerances.
struct TriangleError {
  double squares = 0;  ///< sum of the squared errors
  float worst = 0;     ///< greatest error
  int row = -1;        ///< of the pixel that has it; −1: no pixel with a weight
};
TriangleError scan_error(DepthField const& field, DepthTriangle const& triangle);
/// Column of the first pixel in the row `error.row` that has the error `error.worst`.
int find_worst_column(DepthField const& field, DepthTriangle const& triangle, TriangleError const& error);

/// Sums over the pixels of a triangle, from which the best depths of its corners follow: w the squared weight, r the
/// error (field − triangle), x and y relative to corner 0.
struct TriangleSums {
  double w = 0, wx = 0, wy = 0, wxx = 0, wxy = 0, wyy = 0;
  double wr = 0, wrx = 0, wry = 0, wrr = 0;
  int pixels = 0;  ///< with a weight
};
TriangleSums scan_sums(DepthField const& field, DepthTriangle const& triangle);

/// Σ w λᵢ λⱼ and Σ w r λᵢ: the share of a triangle in the normal equations of its corners' depths.
struct CornerEquations {
  Eigen::Matrix3d matrix;
  Eigen::Vector3d right;
};
CornerEquations corner_equations(DepthTriangle const& triangle, TriangleSums const& sums);

}  // namespace scanview
