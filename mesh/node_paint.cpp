#include "mesh/node_paint.h"

#include <algorithm>
#include <opencv2/core.hpp>

#include "base/srgb.h"

namespace scanview {

cv::Mat3b with_gain(cv::Mat3b const& picture, Eigen::Vector3d const& gain) {
  if (gain == Eigen::Vector3d::Ones()) return picture;
  cv::Mat3b table(1, 256);
  for (int i = 0; i < 256; ++i)
    for (int c = 0; c < 3; ++c) {
      double const linear = std::min(gain[2 - c] * linear_from_srgb8()[std::size_t(i)], 1.0);
      table(0, i)[c] = cv::saturate_cast<uchar>(255 * srgb_from_linear(linear));
    }
  cv::Mat3b result;
  cv::LUT(picture, table, result);
  return result;
}

}  // namespace scanview
