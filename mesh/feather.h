#pragma once
#include <opencv2/core/mat.hpp>

#include "mesh/surface_links.h"

namespace scanview {

/// The boundary weight of every pixel: 0 where the mesh does not cover it, else rising linearly with the Euclidean
/// distance in pixels between its centre and the mesh's boundary, up to 255 at `feather_px`. The boundary is the sides
/// between covered and other pixels, the picture's edge, and step edges, to which both their sides fade.
cv::Mat1b feather_weights(cv::Mat1b const& covered, SurfaceLinks const& links, int feather_px);

}  // namespace scanview
