#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "acquire/range_image.h"

namespace scanview {

/// A point of a view that registration compares with other views, in camera coordinates.
struct SurfaceSample {
  Eigen::Vector3d point;
  Eigen::Vector3d normal;  ///< unit, towards the camera
  float sigma = 0;         ///< of the depth, units
  float tone = 0;          ///< see ViewSurface::tone; NaN where there is none
  int x = 0, y = 0;        ///< pixel
};

/// One view at one level of its pyramid, as registration sees it: a plane is fitted around every pixel (in inverse
/// depth for a perspective camera, where planes are linear), which closes single missing pixels, gives the normal, and
/// leaves out pixels at outlines and steps, whose window is supported from one side only.
struct ViewSurface {
  Camera camera;
  cv::Mat1f depth;   ///< of the fitted plane at the pixel; NaN: no surface, or an outline
  cv::Mat3f normal;  ///< unit, towards the camera
  cv::Mat1f sigma;   ///< of the depth, units
  /// Logarithm of the brightness less its blur (a few pixels), so that shading and gain, which multiply, drop out. NaN
  /// outside the object; empty where the view has no colour, or only shading.
  cv::Mat1f tone;
  cv::Mat2f tone_gradient;             ///< a pixel
  std::vector<SurfaceSample> samples;  ///< row by row on a square grid of `stride` pixels
  int stride = 1;
};

/// Level 0 is the finest. A view without depths has levels without samples.
struct SurfacePyramid {
  std::vector<ViewSurface> levels;
  Eigen::Vector3d centroid{0, 0, 0};  ///< component-wise median of the points, camera coordinates
  double radius = 0;                  ///< 95 % of the points are nearer to the centroid
  std::size_t depths = 0;
};

struct PyramidOptions {
  int levels = 4;                   ///< fewer where the picture is small
  std::size_t max_samples = 12000;  ///< a level: the stride follows
};

/// Cost: pixels times the fitting window (25 to 169, wider where noise is larger than a pixel).
SurfacePyramid build_pyramid(RangeImage const& image, PyramidOptions const& options = {});

}  // namespace scanview
