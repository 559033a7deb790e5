#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

namespace scanview {

/// A picture laid flat in a window: which of its pixels is where. Pixels' centres are integers on both sides.
class PictureSheet {
 public:
  PictureSheet() = default;
  /// Whole and in the middle of a window of that size, in pixels (all at least 1).
  PictureSheet(cv::Size const& picture, cv::Size const& window);
  /// Another window; the middle of what was seen stays in the middle.
  void resize(cv::Size const& window);
  /// What lies under the place keeps its place; a step is a quarter larger. From a quarter of the whole picture to 64
  /// window pixels a pixel.
  void zoom(double x, double y, double steps);
  void pan(double dx, double dy);

  Eigen::Vector2d to_picture(double x, double y) const;
  Eigen::Vector2d to_window(Eigen::Vector2d const& pixel) const;
  /// The window's content; alpha 0 beside the picture. Pixels are seen as squares once they are four or more wide.
  cv::Mat4b draw(cv::Mat3b const& picture) const;

 private:
  cv::Size picture_{1, 1}, window_{1, 1};
  double fit_ = 1, scale_ = 1;    ///< window pixels a pixel
  Eigen::Vector2d corner_{0, 0};  ///< of the picture's outline, from the window's
};

}  // namespace scanview
