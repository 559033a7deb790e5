#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <opencv2/core/mat.hpp>

namespace scanview {

/// What procedural objects are painted with. Colours are sRGB, R G B in [0, 1]; lengths in the unit of the points.

/// 0xRRGGBB.
Eigen::Vector3f rgb(std::uint32_t hex);
/// For a TriangleMesh: 8 bits, B G R.
cv::Vec3b bgr_from_paint(Eigen::Vector3f const& color);
cv::Vec3b bgr_from_paint(std::uint32_t hex);
/// Each channel brought to an albedo (linear) of 0.04 to 0.9, as cloth, paint and plants have.
Eigen::Vector3f within_albedo(Eigen::Vector3f const& color);
Eigen::Vector3f mix(Eigen::Vector3f const& a, Eigen::Vector3f const& b, float t);

/// 0 below `edge`, 1 above, with a soft step `width` wide.
float soft_step(float edge, float x, float width);
/// 1 where a distance is negative, 0 where it is positive, with a soft step `width` wide.
float inside(float distance, float width = 0.3f);

/// Spots of differing sizes on a jittered grid: the distance to the rim of the spot of p's own cell, negative on it.
/// Radii are `radius` times 0.2 to 1.8; `cell` must be four times that or more for whole spots.
float spots_distance(Eigen::Vector3f const& p, float cell, float radius);

/// Words drawn once into a picture: `ink` is the share of ink in [0, 1] at a place in the text's own units, height 1.
class Lettering {
 public:
  explicit Lettering(char const* words);
  float width() const { return static_cast<float>(ink_.cols) / kHeight; }
  /// x from 0 to width(), y from 0 (bottom) to 1.
  float ink(float x, float y) const;

 private:
  static constexpr int kHeight = 64, kThickness = 5;
  static constexpr double kScale = 1.7;
  cv::Mat1b ink_;
};

}  // namespace scanview
