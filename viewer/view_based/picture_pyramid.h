#pragma once
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mesh/view_mesh.h"

namespace scanview {

/// A view's picture where its mesh covers it, in falling resolution: what both back ends sample, so that they draw the
/// same. Level 0 is `area` of the picture; each next one is half as large (rounded down), the mean of what it covers,
/// taken in linear light, down to a single pixel. 8-bit sRGB (BGR).
struct PicturePyramid {
  cv::Rect area;  ///< with a pixel around the mesh, inside the picture
  std::vector<cv::Mat3b> levels;
  cv::Mat1b feather;  ///< of `area`: the square root of the view's, 255 is 1
};

/// The levels of a picture, itself the first, `most` at most.
std::vector<cv::Mat3b> picture_levels(cv::Mat3b const& picture, std::size_t most);

/// `padded`: padded_texture() of the view.
PicturePyramid picture_pyramid(cv::Mat3b const& padded, ViewMesh const& view_mesh);

/// cos φ of each triangle in 16 bits: 65535 is 1.
std::vector<std::uint16_t> cosine_labels(ViewMesh const& view_mesh);

}  // namespace scanview
