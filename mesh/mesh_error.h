#pragma once
#include <opencv2/core/mat.hpp>

#include "mesh/view_mesh.h"

namespace scanview {

/// A mesh in camera coordinates against the range image it was made from.
struct MeshError {
  MeshFigures figures;
  cv::Mat1b covered;  ///< 255 where a triangle covers the pixel's centre
};

/// Every triangle's depth is taken at the pixel centres it covers, a shared edge's once (linear in 1/z under
/// perspective); where several cover a centre the nearest counts. Linear in the number of pixels covered.
MeshError measure_mesh(RangeImage const& image, TriangleMesh const& mesh);

}  // namespace scanview
