#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <opencv2/core/mat.hpp>

#include "calib/camera.h"

namespace scanview {

inline constexpr float kMissing = std::numeric_limits<float>::quiet_NaN();

/// What a pixel is, and why a depth is missing. The values are those of mask.png: far enough apart to be seen.
enum class PixelClass : std::uint8_t {
  background = 0,  ///< not the object: static background, empty scene, backdrop
  cut = 40,        ///< outside the box or below the ground plane that was asked for
  outlier = 80,    ///< a depth that stands alone or flies between two surfaces
  no_depth = 160,  ///< object (or unknown), but the sensor gave nothing
  // Why an active-light scanner gave nothing (acquire.h):
  no_light = 100,       ///< the light did not reach it, or too little came back
  saturated = 120,      ///< too bright to tell when or where the light was
  several_peaks = 140,  ///< lit more than once: an edge, a glossy reflection, or code bits that contradict each other
  no_partner = 180,     ///< the other camera sees no such code on the epipolar line
  inconsistent = 200,   ///< several partners, or the partner's partner is another pixel
  object = 255,         ///< has a depth
};

/// Colour and range from one camera. depth, sigma, color and classes have the camera's size. A depth is finite and
/// positive (perspective) or finite (orthographic) exactly where the class is `object`; sigma is then finite and
/// positive. Elsewhere both are NaN. color is 8-bit sRGB in OpenCV's order (BGR), and may be empty only while a set is
/// being built.
struct RangeImage {
  Camera camera;
  cv::Mat1f depth;  ///< z along the camera axis, in the set's unit
  cv::Mat1f sigma;  ///< one standard deviation of depth, same unit
  cv::Mat3b color;
  cv::Mat1b classes;  ///< PixelClass

  bool has_depth(int x, int y) const { return classes(y, x) == static_cast<std::uint8_t>(PixelClass::object); }
  Eigen::Vector3d point(int x, int y) const { return camera.unproject(x, y, depth(y, x)); }
  /// Takes the depth away and remembers why.
  void remove(int x, int y, PixelClass why);
  std::size_t count_depths() const;
  /// Throws std::logic_error where the invariants above do not hold: call it where a RangeImage was made.
  void check() const;
};

/// An image of the camera's size with no depth at all (class no_depth).
RangeImage empty_range_image(Camera const& camera);

/// Unit normals towards the camera, in camera coordinates, from a plane fitted to the depths within `radius` pixels
/// that belong to the same surface (depth steps beyond `step_sigmas` sigma plus slope are not crossed). CV_32FC3, NaN
/// where fewer than 3 neighbours are there or they are collinear.
cv::Mat3f estimate_normals(RangeImage const& image, int radius = 2, double step_sigmas = 6.0);

}  // namespace scanview
