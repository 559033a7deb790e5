#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace scanview {

/// A picture (8-bit sRGB, BGR) whose linear light is multiplied by R, G, B (View::gain); what gets too bright ends at
/// white.
cv::Mat3b with_gain(cv::Mat3b const& picture, Eigen::Vector3d const& gain);

}  // namespace scanview
