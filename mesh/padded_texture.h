#pragma once
#include <opencv2/core/mat.hpp>

#include "acquire/range_image.h"
#include "mesh/view_mesh.h"

namespace scanview {

/// The colour picture of a view with every pixel that is neither object nor covered by the mesh replaced by the nearest
/// one that is, so that filtering at the outline never fetches background. A picture without any object stays as it is.
/// Throws Error{bad_input} where picture, classes or feather do not have the camera's size.
cv::Mat3b padded_texture(RangeImage const& image, ViewMesh const& view_mesh);

}  // namespace scanview
