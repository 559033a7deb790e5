#pragma once
#include "viewer/gl/gl_objects.h"
#include "viewer/renderer.h"

namespace scanview {

/// Shows a Frame on the default framebuffer, over a dark background; a frame of another size is scaled.
class FramePresenter {
 public:
  explicit FramePresenter(GlFunctions const& gl);
  void present(Frame const& frame, int width, int height);

 private:
  GlFunctions const& gl_;
  GlProgram program_;
  GlVertexArray no_vertices_;
  GlTexture texture_;
};

}  // namespace scanview
