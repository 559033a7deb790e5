#include "mesh/feather.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanview {

cv::Mat1b feather_weights(cv::Mat1b const& covered, SurfaceLinks const& links, int feather_px) {
  // A grid of half pixels: centres at odd places, corners at even ones, sides between.
  cv::Mat1b open(2 * covered.rows + 1, 2 * covered.cols + 1, uchar(255));
  auto inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < covered.cols && y < covered.rows && covered(y, x) != 0;
  };
  auto joined = [&](int x0, int y0, int x1, int y1) {
    return inside(x0, y0) && inside(x1, y1) && links.linked(x0, y0, x1, y1);
  };
  auto close = [&](int x2, int y2) { open(y2, x2) = 0; };
  for (int y = 0; y < covered.rows; ++y)
    for (int x = 0; x < covered.cols; ++x) {
      if (!inside(x, y)) {
        close(2 * x + 1, 2 * y + 1);
        continue;
      }
      int const cx = 2 * x + 1, cy = 2 * y + 1;
      for (int side = -1; side <= 1; ++side) {
        if (!joined(x, y, x - 1, y)) close(cx - 1, cy + side);
        if (!joined(x, y, x + 1, y)) close(cx + 1, cy + side);
        if (!joined(x, y, x, y - 1)) close(cx + side, cy - 1);
        if (!joined(x, y, x, y + 1)) close(cx + side, cy + 1);
      }
    }
  cv::Mat1f distance;
  cv::distanceTransform(open, distance, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  cv::Mat1b feather = cv::Mat1b::zeros(covered.size());
  for (int y = 0; y < covered.rows; ++y)
    for (int x = 0; x < covered.cols; ++x)
      if (inside(x, y)) {
        double const pixels = distance(2 * y + 1, 2 * x + 1) / 2;
        feather(y, x) = uchar(std::clamp(std::lround(255 * pixels / feather_px), 1L, 255L));
      }
  return feather;
}

}  // namespace scanview
