#include "mesh/feather.h"

#include <algorithm>
#include <cmath>
#include <vector>

namespace scanview {
namespace {

/// A grid of half pixels: centres at odd places, corners at even ones, sides between. 0 where it is not on the surface,
/// else 255.
cv::Mat1b open_places(cv::Mat1b const& covered, SurfaceLinks const& links) {
  cv::Mat1b open(2 * covered.rows + 1, 2 * covered.cols + 1, uchar(255));
  auto const inside = [&](int x, int y) {
    return x >= 0 && y >= 0 && x < covered.cols && y < covered.rows && covered(y, x) != 0;
  };
  auto const joined = [&](int x0, int y0, int x1, int y1) {
    return inside(x0, y0) && inside(x1, y1) && links.linked(x0, y0, x1, y1);
  };
  auto const close = [&](int x2, int y2) { open(y2, x2) = 0; };
  for (int y = 0; y < covered.rows; ++y)
    for (int x = 0; x < covered.cols; ++x) {
      int const cx = 2 * x + 1, cy = 2 * y + 1;
      if (!inside(x, y)) {
        close(cx, cy);
        continue;
      }
      bool const left = joined(x, y, x - 1, y), right = joined(x, y, x + 1, y);
      bool const above = joined(x, y, x, y - 1), below = joined(x, y, x, y + 1);
      if (left && right && above && below) continue;
      for (int side = -1; side <= 1; ++side) {
        if (!left) close(cx - 1, cy + side);
        if (!right) close(cx + 1, cy + side);
        if (!above) close(cx + side, cy - 1);
        if (!below) close(cx + side, cy + 1);
      }
    }
  return open;
}

/// In each row of pixel centres the distance to the nearest closed place above or below, in half pixels, `most` at
/// most.
template <typename Distance>
cv::Mat_<Distance> distances_along_columns(cv::Mat1b const& open, int most) {
  cv::Mat_<Distance> result(open.rows / 2, open.cols);
  std::vector<Distance> distance(open.cols, Distance(most));
  auto const step = [&](int row) {
    uchar const* const places = open[row];
    for (int x = 0; x < open.cols; ++x) {
      Distance const farther = Distance(distance[x] + (distance[x] < most));
      distance[x] = places[x] ? farther : Distance(0);
    }
  };
  for (int row = 0; row < open.rows; ++row) {
    step(row);
    if (row % 2 == 1) std::copy(distance.begin(), distance.end(), result[row / 2]);
  }
  std::fill(distance.begin(), distance.end(), Distance(most));
  for (int row = open.rows - 1; row >= 0; --row) {
    step(row);
    if (row % 2 == 0) continue;
    Distance* const known = result[row / 2];
    for (int x = 0; x < open.cols; ++x) known[x] = std::min(known[x], distance[x]);
  }
  return result;
}

/// Exact Euclidean distances up to the one that counts: along columns first, then the nearest of all columns within
/// reach (Saito and Toriwaki 1994). `Distance` holds `most`.
template <typename Distance>
cv::Mat1b weights(cv::Mat1b const& covered, SurfaceLinks const& links, int feather_px, int most) {
  cv::Mat_<Distance> const along = distances_along_columns<Distance>(open_places(covered, links), most);
  cv::Mat1b feather = cv::Mat1b::zeros(covered.size());
  for (int y = 0; y < covered.rows; ++y) {
    Distance const* const column = along[y];
    int next = 0;  // the first column from x on whose closed places are within reach
    for (int x = 0; x < covered.cols; ++x) {
      if (!covered(y, x)) continue;
      int const center = 2 * x + 1;
      long best = long(column[center]) * column[center];
      next = std::max(next, center - most);
      while (next < along.cols && column[next] >= most) ++next;
      long const reach = std::min(long(std::ceil(std::sqrt(double(best)))), long(most));
      long const last = std::min(center + reach, long(along.cols) - 1);
      for (long at = std::max(long(next), center - reach); at <= last; ++at)
        best = std::min(best, (at - center) * (at - center) + long(column[at]) * column[at]);
      if (best >= long(2 * feather_px) * (2 * feather_px)) {
        feather(y, x) = 255;
        continue;
      }
      double const pixels = std::sqrt(double(best)) / 2;
      feather(y, x) = uchar(std::clamp(std::lround(255 * pixels / feather_px), 1L, 255L));
    }
  }
  return feather;
}

}  // namespace

cv::Mat1b feather_weights(cv::Mat1b const& covered, SurfaceLinks const& links, int feather_px) {
  int const most = std::min(2 * feather_px + 1, 65535);
  return most <= 255 ? weights<uchar>(covered, links, feather_px, most)
                     : weights<ushort>(covered, links, feather_px, most);
}

}  // namespace scanview
