#include "viewer/window/frame_presenter.h"

#include <cmath>

#include "base/error.h"

namespace scanview {

void compose_background(cv::Mat4b const& picture, cv::Mat4b& composed) {
  composed.create(picture.size());
  for (int y = 0; y < picture.rows; ++y) {
    double const t = (y + 0.5) / picture.rows;
    auto const shade = [&](double top, double bottom) {
      return static_cast<std::uint32_t>(std::lround(255 * ((1 - t) * top + t * bottom)));
    };
    std::uint32_t const blue = shade(0.27, 0.12), green = shade(0.24, 0.11), red = shade(0.22, 0.10);
    cv::Vec4b const* const from = picture[y];
    cv::Vec4b* const to = composed[y];
    cv::Vec4b const shade_of_row(static_cast<std::uint8_t>(blue), static_cast<std::uint8_t>(green),
                                 static_cast<std::uint8_t>(red), 255);
    for (int x = 0; x < picture.cols; ++x) {
      std::uint32_t const a = from[x][3], b = 255 - a;
      // Most pixels are one or the other.
      if (a == 255 || a == 0) {
        to[x] = a == 0 ? shade_of_row : from[x];
        continue;
      }
      to[x][0] = static_cast<std::uint8_t>((a * from[x][0] + b * blue + 127) / 255);
      to[x][1] = static_cast<std::uint8_t>((a * from[x][1] + b * green + 127) / 255);
      to[x][2] = static_cast<std::uint8_t>((a * from[x][2] + b * red + 127) / 255);
      to[x][3] = 255;
    }
  }
}

FramePresenter::FramePresenter(GlFunctions const& gl) : gl_(gl), texture_(gl), source_(gl) {
  upload(cv::Mat4b(2, 2, cv::Vec4b(0, 0, 0, 0)));
}

void FramePresenter::upload(cv::Mat4b const& picture) {
  if (picture.empty()) return;
  bool const resized = picture.size() != size_;
  compose_background(picture, composed_);
  gl_.BindTexture(GL_TEXTURE_2D, texture_.name());
  gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
  if (!resized) {
    gl_.TexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, composed_.cols, composed_.rows, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV,
                      composed_.data);
    return;
  }
  // Without a size OpenGL takes the order of the bytes that are there, which is mostly the window's too: what follows
  // are then copies without arithmetic.
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA, composed_.cols, composed_.rows, 0, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV,
                 composed_.data);
  size_ = picture.size();
  gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, source_.name());
  gl_.FramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture_.name(), 0);
  if (gl_.CheckFramebufferStatus(GL_READ_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE)
    throw Error(ErrorCode::io, {}, "OpenGL: pictures cannot be copied to the window");
}

void FramePresenter::present(Viewport const& part, int height) {
  gl_.BindFramebuffer(GL_READ_FRAMEBUFFER, source_.name());
  gl_.ReadBuffer(GL_COLOR_ATTACHMENT0);
  gl_.BindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
  constexpr float kAround[] = {0.13F, 0.14F, 0.16F, 1};
  gl_.ClearBufferfv(GL_COLOR, 0, kAround);
  // The picture's first row is its top, the framebuffer's its bottom.
  gl_.BlitFramebuffer(0, 0, size_.width, size_.height, part.x, height - part.y, part.x + part.width,
                      height - part.y - part.height, GL_COLOR_BUFFER_BIT,
                      size_ == cv::Size(part.width, part.height) ? GL_NEAREST : GL_LINEAR);
  gl_.BindFramebuffer(GL_FRAMEBUFFER, 0);
}

}  // namespace scanview
