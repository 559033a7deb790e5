#include "viewer/blend/layer_targets.h"

#include <fmt/format.h>

#include "base/error.h"

namespace scanview {

LayerTargets::LayerTargets(GlFunctions const& gl) : gl_(gl), framebuffer_(gl) {}

void LayerTargets::resize(int width, int height, int layers) {
  if (width == width_ && height == height_ && layers <= layers_) return;
  if (width > gl_.max_texture_size || height > gl_.max_texture_size || layers > gl_.max_array_layers) {
    throw Error(
        ErrorCode::bad_input, {},
        fmt::format("a picture of {} x {} from {} views is more than OpenGL can draw here ({} pixels, {} views)", width,
                    height, layers, gl_.max_texture_size, gl_.max_array_layers));
  }
  auto const nearest = [&](GLenum target) {
    gl_.TexParameteri(target, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    gl_.TexParameteri(target, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
  };
  width_ = height_ = layers_ = 0;
  samples_ = GlTexture(gl_);
  gl_.BindTexture(GL_TEXTURE_2D_ARRAY, samples_.name());
  gl_.TexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA32F, width, height, layers, 0, GL_RGBA, GL_FLOAT, nullptr);
  nearest(GL_TEXTURE_2D_ARRAY);
  light_ = GlTexture(gl_);
  gl_.BindTexture(GL_TEXTURE_2D_ARRAY, light_.name());
  gl_.TexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA16F, width, height, layers, 0, GL_RGBA, GL_FLOAT, nullptr);
  nearest(GL_TEXTURE_2D_ARRAY);
  depth_buffer_ = GlTexture(gl_);
  gl_.BindTexture(GL_TEXTURE_2D, depth_buffer_.name());
  gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT32F, width, height, 0, GL_DEPTH_COMPONENT, GL_FLOAT, nullptr);
  nearest(GL_TEXTURE_2D);

  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, depth_buffer_.name(), 0);
  check_gl(gl_, "the targets of the views");
  width_ = width;
  height_ = height;
  layers_ = layers;
}

void LayerTargets::begin_layer(int layer) {
  gl_.BindFramebuffer(GL_FRAMEBUFFER, framebuffer_.name());
  gl_.FramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, samples_.name(), 0, layer);
  gl_.FramebufferTextureLayer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT1, light_.name(), 0, layer);
  GLenum const buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
  gl_.DrawBuffers(2, buffers);
  if (gl_.CheckFramebufferStatus(GL_FRAMEBUFFER) != GL_FRAMEBUFFER_COMPLETE) {
    throw Error(ErrorCode::io, {}, "OpenGL cannot draw into float textures here");
  }
  gl_.Viewport(0, 0, width_, height_);
  float const nothing[] = {0, 0, 0, 0}, far_away[] = {1, 0, 0, 0};
  gl_.ClearBufferfv(GL_COLOR, 0, nothing);
  gl_.ClearBufferfv(GL_DEPTH, 0, far_away);
}

}  // namespace scanview
