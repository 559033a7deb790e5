#include "mesh/hole_fill.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "mesh/surface_links.h"

namespace scanview {
namespace {

class HoleFill {
 public:
  HoleFill(RangeImage const& image, double step_sigmas, int most_pixels)
      : image_(image),
        step_sigmas_(step_sigmas),
        most_pixels_(most_pixels),
        seen_(cv::Mat1b::zeros(image.depth.size())) {}

  RangeImage run() {
    result_ = image_;
    for (int y = 0; y < image_.depth.rows; ++y)
      for (int x = 0; x < image_.depth.cols; ++x)
        if (!image_.has_depth(x, y) && !seen_(y, x) && collect(x, y)) fill();
    return result_;
  }

 private:
  /// The hole around a pixel and the pixels around the hole. False where it can't be filled.
  bool collect(int x, int y) {
    hole_ = {{x, y}};
    ring_.clear();
    seen_(y, x) = 1;
    bool fillable = true;
    for (std::size_t i = 0; i < hole_.size(); ++i) {
      cv::Point const at = hole_[i];
      auto const why = static_cast<PixelClass>(image_.classes(at));
      if (why == PixelClass::background || why == PixelClass::cut) fillable = false;
      for (int dy = -1; dy <= 1; ++dy)
        for (int dx = -1; dx <= 1; ++dx) {
          cv::Point const next(at.x + dx, at.y + dy);
          if (next.x < 0 || next.y < 0 || next.x >= image_.depth.cols || next.y >= image_.depth.rows) {
            fillable = false;
          } else if (image_.has_depth(next.x, next.y)) {
            if (int(hole_.size()) <= most_pixels_) ring_.push_back(next);
          } else if (!seen_(next)) {
            seen_(next) = 1;
            hole_.push_back(next);
          }
        }
    }
    return fillable && int(hole_.size()) <= most_pixels_;
  }

  void fill() {
    cv::Point const origin = hole_.front();
    double const base = linear(ring_.front());
    Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (cv::Point const& p : ring_) {
      Eigen::Vector3d const row(1, p.x - origin.x, p.y - origin.y);
      matrix += row * row.transpose();
      right += (linear(p) - base) * row;
    }
    Eigen::Vector3d const plane = matrix.ldlt().solve(right);
    auto const depth_at = [&](cv::Point const& p) {
      return linear_depth(image_.camera, base + plane.dot(Eigen::Vector3d(1, p.x - origin.x, p.y - origin.y)));
    };
    float sigma = 0;
    for (cv::Point const& p : ring_) {
      double const z = depth_at(p), within = step_sigmas_ * image_.sigma(p) + image_.camera.pixel_size(image_.depth(p));
      if (!(std::abs(z - image_.depth(p)) <= within)) return;
      sigma = std::max(sigma, image_.sigma(p));
    }
    for (cv::Point const& p : hole_)
      if (!std::isfinite(depth_at(p)) || (image_.camera.is_perspective() && !(depth_at(p) > 0))) return;
    if (result_.depth.data == image_.depth.data) {
      result_.depth = image_.depth.clone();
      result_.sigma = image_.sigma.clone();
      result_.classes = image_.classes.clone();
    }
    constexpr float kHardlyCounts = 10;
    for (cv::Point const& p : hole_) {
      result_.depth(p) = float(depth_at(p));
      result_.sigma(p) = std::min(kHardlyCounts * sigma, std::numeric_limits<float>::max());
      result_.classes(p) = static_cast<std::uint8_t>(PixelClass::object);
    }
  }

  double linear(cv::Point const& p) const { return linear_depth(image_.camera, image_.depth(p)); }

  RangeImage const& image_;
  double step_sigmas_;
  int most_pixels_;
  cv::Mat1b seen_;
  std::vector<cv::Point> hole_, ring_;
  RangeImage result_;
};

}  // namespace

RangeImage fill_small_holes(RangeImage const& image, double step_sigmas, int most_pixels) {
  return HoleFill(image, step_sigmas, most_pixels).run();
}

}  // namespace scanview
