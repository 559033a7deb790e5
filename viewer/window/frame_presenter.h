#pragma once
#include <opencv2/core/mat.hpp>

#include "viewer/gl/gl_objects.h"
#include "viewer/window/window_event.h"

namespace scanview {

/// Shows a picture in a part of the default framebuffer, over a dark background. The picture is uploaded once and can
/// be shown again for nothing but a copy.
class FramePresenter {
 public:
  explicit FramePresenter(GlFunctions const& gl);
  /// Straight alpha, BGRA (Frame::color).
  void upload(cv::Mat4b const& picture);
  /// Scaled into `part` of a framebuffer of `height` rows, what is around it cleared. Before any upload, background
  /// alone.
  void present(Viewport const& part, int height);

 private:
  GlFunctions const& gl_;
  GlTexture texture_;
  GlFramebuffer source_;
  cv::Mat4b composed_;
  cv::Size size_;  ///< of the texture
};

/// Lays a picture over the viewer's background, darker towards the bottom. Alpha 255 keeps every bit.
void compose_background(cv::Mat4b const& picture, cv::Mat4b& composed);

}  // namespace scanview
