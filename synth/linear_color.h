#pragma once
#include <Eigen/Core>
#include <opencv2/core/matx.hpp>
#include <string>

namespace scanview {

/// What a picture shows where nothing is, unless it is asked for otherwise.
inline constexpr char const* kSkyColor = "#606e80";

/// Linear R G B of "#rrggbb" (sRGB); throws Error{usage} for anything else.
Eigen::Vector3f linear_from_hex(std::string const& hex);

/// Linear R G B of an 8-bit sRGB colour in OpenCV's order (B G R).
Eigen::Vector3f linear_from_bgr(cv::Vec3b const& bgr);

/// sRGB of linear R G B, 0 to 255 and not yet rounded, in OpenCV's order (B G R); clipped.
cv::Vec3d bgr_from_linear(Eigen::Vector3f const& linear);

/// What a gray camera sees of linear R G B (ITU-R BT.709).
inline float luminance(Eigen::Vector3f const& linear) {
  return 0.2126f * linear.x() + 0.7152f * linear.y() + 0.0722f * linear.z();
}

}  // namespace scanview
