#include "viewer/window/picture_sheet.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace scanview {

using Eigen::Vector2d;

PictureSheet::PictureSheet(cv::Size const& picture, cv::Size const& window)
    : picture_(std::max(1, picture.width), std::max(1, picture.height)),
      window_(std::max(1, window.width), std::max(1, window.height)) {
  fit_ = scale_ = std::min(static_cast<double>(window_.width) / picture_.width,
                           static_cast<double>(window_.height) / picture_.height);
  corner_ = 0.5 * Vector2d(window_.width - scale_ * picture_.width, window_.height - scale_ * picture_.height);
}

void PictureSheet::resize(cv::Size const& window) {
  if (window == window_) return;
  PictureSheet next(picture_, window);
  Vector2d const middle = (0.5 * Vector2d(window_.width, window_.height) - corner_) / scale_;
  next.scale_ = scale_ / fit_ * next.fit_;
  next.corner_ = 0.5 * Vector2d(next.window_.width, next.window_.height) - next.scale_ * middle;
  *this = next;
}

void PictureSheet::zoom(double x, double y, double steps) {
  double const wanted =
      std::clamp(scale_ * std::pow(1.25, steps), std::min(0.25 * fit_, 64.0), std::max(64.0, 0.25 * fit_));
  Vector2d const at(x + 0.5, y + 0.5);
  corner_ = at - (at - corner_) * (wanted / scale_);
  scale_ = wanted;
}

void PictureSheet::pan(double dx, double dy) { corner_ += Vector2d(dx, dy); }

Vector2d PictureSheet::to_picture(double x, double y) const {
  return (Vector2d(x + 0.5, y + 0.5) - corner_) / scale_ - Vector2d(0.5, 0.5);
}

Vector2d PictureSheet::to_window(Vector2d const& pixel) const {
  return scale_ * (pixel + Vector2d(0.5, 0.5)) + corner_ - Vector2d(0.5, 0.5);
}

cv::Mat4b PictureSheet::draw(cv::Mat3b const& picture) const {
  cv::Mat4b opaque, result(window_, cv::Vec4b(0, 0, 0, 0));
  if (picture.empty()) return result;
  cv::cvtColor(picture, opaque, cv::COLOR_BGR2BGRA);
  Vector2d const origin = to_window({0, 0});
  cv::Matx23d const window_from_picture(scale_, 0, origin.x(), 0, scale_, origin.y());
  cv::warpAffine(opaque, result, window_from_picture, window_, scale_ >= 4 ? cv::INTER_NEAREST : cv::INTER_LINEAR,
                 cv::BORDER_CONSTANT, cv::Scalar::all(0));
  return result;
}

}  // namespace scanview
