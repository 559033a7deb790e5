#pragma once
#include <vector>

#include "acquire/decode_capture.h"
#include "calib/epipolar_fit.h"

namespace scanview {

/// What both cameras saw of the same cell of the projector (column and row): the centroids of its pixels. Empty where
/// the capture has no row bits. Cells of fewer than two pixels in a camera, or spread over more than a cell's size, are
/// left out.
std::vector<Correspondence> code_correspondences(DecodedSide const& left, DecodedSide const& right, Context& context);

}  // namespace scanview
