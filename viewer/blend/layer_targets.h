#pragma once
#include "viewer/gl/gl_objects.h"

namespace scanview {

/// Where the views are drawn before they are composed: a layer a view of a float texture array (RGBA32F): z in the
/// rendering camera; quality w_cos · w_feather, 0 where nothing was drawn (16 bits would let the back ends disagree on
/// which samples count); fairness; level of detail, -1 on a line of a wireframe. Row 0 is the top row of the picture.
/// Layers share
/// one depth buffer. Beside it (RGBA16F) the light, as a share of what the view's camera saw.
class LayerTargets {
 public:
  explicit LayerTargets(GlFunctions const& gl);
  /// Makes room; keeps what is there where it is large enough and of the same size. Throws Error{bad_input} where the
  /// picture or the number of layers is more than OpenGL can do, Error{io} out of memory.
  void resize(int width, int height, int layers);
  /// Binds a layer for drawing, its viewport, and clears it.
  void begin_layer(int layer);
  GLuint samples() const { return samples_.name(); }
  GLuint light() const { return light_.name(); }
  int width() const { return width_; }
  int height() const { return height_; }

 private:
  GlFunctions const& gl_;
  GlTexture samples_, light_, depth_buffer_;
  GlFramebuffer framebuffer_;
  int width_ = 0, height_ = 0, layers_ = 0;
};

}  // namespace scanview
