#pragma once
#include <Eigen/Core>
#include <string>

namespace scanview {

/// Linear R G B of "#rrggbb" (sRGB); throws Error{usage} for anything else.
Eigen::Vector3f linear_from_hex(std::string const& hex);

/// What a gray camera sees of linear R G B (ITU-R BT.709).
inline float luminance(Eigen::Vector3f const& linear) {
  return 0.2126f * linear.x() + 0.7152f * linear.y() + 0.0722f * linear.z();
}

}  // namespace scanview
