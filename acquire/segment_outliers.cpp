#include "acquire/segment_outliers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "acquire/depth_noise.h"

namespace scanview {
namespace {

double allowed(RangeImage const& image, cv::Point a, cv::Point b) {
  return largest_step(image.camera, std::min(image.depth(a), image.depth(b)), image.sigma(a), image.sigma(b),
                      cv::norm(a - b));
}

bool joined(RangeImage const& image, cv::Point a, cv::Point b) {
  return std::abs(image.depth(a) - image.depth(b)) <= allowed(image, a, b);
}

/// Between a nearer and a farther neighbour on opposite sides, apart from both by more than noise, while these are
/// apart by more than one surface explains.
bool flies(RangeImage const& image, cv::Point p) {
  cv::Rect const inside({0, 0}, image.depth.size());
  for (cv::Point const d : {cv::Point(1, 0), cv::Point(0, 1), cv::Point(1, 1), cv::Point(1, -1)})
    for (int reach = 1; reach <= 2; ++reach) {
      cv::Point const a = p - reach * d, b = p + reach * d;
      if (!inside.contains(a) || !inside.contains(b) || !image.has_depth(a.x, a.y) || !image.has_depth(b.x, b.y))
        continue;
      double const to_a = image.depth(p) - image.depth(a), to_b = image.depth(p) - image.depth(b);
      if (to_a * to_b < 0 && !joined(image, p, a) && !joined(image, p, b)) return true;
    }
  return false;
}

}  // namespace

cv::Mat1i surface_pieces(RangeImage const& image, std::vector<int>& sizes) {
  cv::Mat1i labels(image.depth.size(), 0);
  cv::Rect const inside({0, 0}, image.depth.size());
  sizes.assign(1, 0);
  std::vector<cv::Point> front;
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x) {
      if (labels(y, x) != 0 || !image.has_depth(x, y)) continue;
      int const label = static_cast<int>(sizes.size());
      sizes.push_back(0);
      labels(y, x) = label;
      front.assign(1, {x, y});
      while (!front.empty()) {
        cv::Point const p = front.back();
        front.pop_back();
        ++sizes.back();
        for (cv::Point const q : {p + cv::Point(1, 0), p + cv::Point(-1, 0), p + cv::Point(0, 1), p + cv::Point(0, -1)})
          if (inside.contains(q) && labels(q) == 0 && image.has_depth(q.x, q.y) && joined(image, p, q)) {
            labels(q) = label;
            front.push_back(q);
          }
      }
    }
  return labels;
}

std::size_t remove_outliers(RangeImage& image, int smallest_piece) {
  std::vector<cv::Point> flying;
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x)
      if (image.has_depth(x, y) && flies(image, {x, y})) flying.emplace_back(x, y);
  for (cv::Point const p : flying) image.remove(p.x, p.y, PixelClass::outlier);
  std::size_t removed = flying.size();
  std::vector<int> sizes;
  cv::Mat1i const labels = surface_pieces(image, sizes);
  for (int y = 0; y < labels.rows; ++y)
    for (int x = 0; x < labels.cols; ++x)
      if (labels(y, x) > 0 && sizes[static_cast<std::size_t>(labels(y, x))] < smallest_piece) {
        image.remove(x, y, PixelClass::outlier);
        ++removed;
      }
  return removed;
}

std::size_t remove_hanging_scraps(RangeImage& image, double smallest_share) {
  constexpr int kNeck = 5;
  cv::Mat1b const object = image.classes == static_cast<std::uint8_t>(PixelClass::object);
  cv::Mat1b inner;
  cv::erode(object, inner, cv::Mat1b::ones(kNeck, kNeck), {-1, -1}, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat1i labels;
  cv::Mat stats, centers;
  int const count = cv::connectedComponentsWithStats(inner, labels, stats, centers, 8, CV_32S);
  int largest = 0;
  for (int label = 1; label < count; ++label) largest = std::max(largest, stats.at<int>(label, cv::CC_STAT_AREA));
  cv::Mat1b small = cv::Mat1b::zeros(object.size()), large = small.clone();
  for (int y = 0; y < object.rows; ++y)
    for (int x = 0; x < object.cols; ++x) {
      if (labels(y, x) == 0) continue;
      bool const is_small = stats.at<int>(labels(y, x), cv::CC_STAT_AREA) < smallest_share * largest;
      (is_small ? small : large)(y, x) = 255;
    }
  std::size_t removed = 0;
  cv::dilate(small, small, cv::Mat1b::ones(kNeck + 2, kNeck + 2));
  cv::dilate(large, large, cv::Mat1b::ones(kNeck, kNeck));
  for (int y = 0; y < object.rows; ++y)
    for (int x = 0; x < object.cols; ++x)
      if (object(y, x) != 0 && small(y, x) != 0 && large(y, x) == 0) {
        image.remove(x, y, PixelClass::outlier);
        ++removed;
      }
  return removed;
}

}  // namespace scanview
