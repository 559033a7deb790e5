#pragma once
#include "acquire/range_image.h"

namespace scanview {

/// Marks as PixelClass::outlier what cannot be a surface:
///   * flying pixels: depths between a near and a far surface that join neither, which cameras that average over a
///   pixel
///     or a matching window put across depth steps;
///   * specks: pieces of surface (4-neighbours within largest_step) of fewer than `smallest_piece` pixels.
/// Returns how many depths went. Linear in pixels.
std::size_t remove_outliers(RangeImage& image, int smallest_piece = 25);

/// Pieces of surface: 4-neighbours both with depths within largest_step. Labels from 1 in raster order of their first
/// pixel, 0 elsewhere; `sizes[label]` is the number of pixels.
cv::Mat1i surface_pieces(RangeImage const& image, std::vector<int>& sizes);

}  // namespace scanview
