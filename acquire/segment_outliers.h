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

/// Removes scraps of the background that touch the object in the picture: pieces below `smallest_share` of its size
/// that hang on it by a neck of at most four pixels. Thin parts of an object have no such bulge, and stay. Returns how
/// many depths went.
std::size_t remove_hanging_scraps(RangeImage& image, double smallest_share);

}  // namespace scanview
