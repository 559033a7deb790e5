#pragma once
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "acquire/range_image.h"

namespace scanview {

/// A raster of heights, as the mesh benchmark's peers take it.
struct DepthMap {
  std::string name;
  double spacing = 1;   ///< of pixels, in the unit of heights
  cv::Mat1f height;     ///< towards the viewer; where nothing was measured the least height minus 5
  cv::Mat1b valid;      ///< 255: measured
  cv::Mat1i surface;    ///< which surface each pixel is on, where that is known; else empty
  double sigma = 1e-3;  ///< of the heights
};

/// The bunny's first scan, cropped (mm), from `bunny_range.tar.xz` in `data`.
DepthMap bunny_depth_map(std::filesystem::path const& data);
/// 1024 × 1024 pixels with a wavy ground and a sphere, a box, a cone and a table of waves above it; unit = pixel.
/// `size` scales the scene to so many pixels a side, `noise` is added as normal errors of so many units (seeded).
DepthMap synthetic_depth_map(int size = 1024, double noise = 0);

/// Seen from above by an orthographic camera, where it is valid; `everywhere`: all of it.
RangeImage to_range_image(DepthMap const& map, bool everywhere);

/// 255 outside one-pixel neighbourhoods of jumps: known changes of surface, holes, and neighbours whose heights differ
/// by more than five pixels' width.
cv::Mat1b away_from_steps(DepthMap const& map);

}  // namespace scanview
