#pragma once
#include <Eigen/Core>
#include <algorithm>
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
  float cosine = 0;        ///< of the angle between the ray and the normal
  float tone = 0;          ///< see ViewSurface::tone; NaN where there is none
  int x = 0, y = 0;        ///< pixel
  bool crease = false;     ///< see SurfacePixel::crease
};

/// What a view knows of the surface at one pixel.
struct SurfacePixel {
  /// As it is linear on planes: 1/z for a perspective camera, z for an orthographic one. As measured; in holes, of the
  /// fitted plane; NaN: no surface, or an outline.
  float linear_depth = kMissing;
  float normal[3] = {kMissing, kMissing, kMissing};  ///< unit, towards the camera
  float sigma = kMissing;                            ///< of the depth z, units
  float bend_u = 0, bend_v = 0;                      ///< second derivatives of the linear depth, by pixels
  /// The surface bends so sharply within the window that its plane is no tangent (finest level only): the normal there
  /// would hold motions that the surface does not hold.
  bool crease = false;
  bool has_surface() const { return linear_depth == linear_depth; }
};

/// One view at one level of its pyramid, as registration sees it: a plane is fitted around every pixel (in inverse
/// depth for a perspective camera, where planes are linear), which closes single missing pixels, gives the normal, and
/// leaves out pixels at outlines and steps, whose window is supported from one side only.
struct ViewSurface {
  Camera camera;
  std::vector<SurfacePixel> pixels;  ///< row by row, of the camera's size
  /// Logarithm of the brightness less its blur (a few pixels), so that shading and gain, which multiply, drop out. NaN
  /// outside the object; empty where the view has no colour, or only shading.
  cv::Mat1f tone;
  cv::Mat2f tone_gradient;             ///< a pixel
  std::vector<SurfaceSample> samples;  ///< row by row on a square grid of `stride` pixels
  int stride = 1;

  SurfacePixel const& at(int x, int y) const {
    return pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera.width()) + static_cast<std::size_t>(x)];
  }
  bool has_surface(int x, int y) const { return at(x, y).has_surface(); }
  /// z at a pixel, units; NaN where there is no surface.
  double depth(int x, int y) const {
    return camera.is_perspective() ? 1.0 / at(x, y).linear_depth : at(x, y).linear_depth;
  }
};

/// Every sample, or those of a coarser square grid, so that about `at_most` remain.
class SampleGrid {
 public:
  SampleGrid(ViewSurface const& surface, std::size_t at_most);
  bool contains(SurfaceSample const& sample) const { return sample.x % pitch_ == 0 && sample.y % pitch_ == 0; }
  int pitch() const { return pitch_; }  ///< pixels between neighbours

 private:
  int pitch_;
};

/// Level 0 is the finest. A view without depths has levels without samples.
struct SurfacePyramid {
  std::vector<ViewSurface> levels;
  Eigen::Vector3d centroid{0, 0, 0};  ///< component-wise median of the points, camera coordinates
  double radius = 0;                  ///< 95 % of the points are nearer to the centroid
  std::size_t depths = 0;
  /// The coarsest where there are not so many.
  ViewSurface const& level(std::size_t number) const { return levels[std::min(number, levels.size() - 1)]; }
};

struct PyramidOptions {
  int levels = 4;                   ///< fewer where the picture is small
  std::size_t max_samples = 12000;  ///< a level: the stride follows
};

/// Cost: pixels times the fitting window (25 to 169, wider where noise is larger than a pixel).
SurfacePyramid build_pyramid(RangeImage const& image, PyramidOptions const& options = {});

}  // namespace scanview
