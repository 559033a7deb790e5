#pragma once
// How the report shows range images: shared by the sections of `import`, `acquire` and `register`.
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "acquire/scan_set.h"

namespace scanview {

inline constexpr std::size_t kMostViewsShown = 40;  ///< with pictures; a page of thousands helps nobody

/// The 1st, 50th and 99th percentile of what is finite; zeros where nothing is.
struct Quantiles {
  double low = 0, middle = 0, high = 0;
};
Quantiles quantiles(cv::Mat1f const& values);

/// The part of the picture that holds depths, with a margin: an object fills little of what its camera sees. All of it
/// where there are none.
cv::Rect object_box(RangeImage const& image);

/// A small square of this colour (BGR), for legends.
std::string color_swatch(cv::Vec3b const& color);

/// One view as a row of figures: the picture with the outline of what has a depth, the depth (near blue, far red), what
/// every pixel is, and sigma up to twice its median. Cropped to what has a depth.
std::string view_row(View const& view, std::string const& unit);

/// The colours of the classes in view_row, in words.
struct ClassName {
  PixelClass pixel;
  std::string meaning;
};
std::string class_legend(std::vector<ClassName> const& names);

std::size_t count_class(RangeImage const& image, PixelClass pixel);

/// " mm", " m", or nothing where the unit is arbitrary.
std::string unit_suffix(Unit unit);

}  // namespace scanview
