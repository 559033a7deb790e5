#pragma once
#include <vector>

#include "viewer/blend/layer_targets.h"
#include "viewer/blend/soft_z.h"
#include "viewer/renderer.h"

namespace scanview {

/// SoftZ with OpenGL.
class SoftZCompositor {
 public:
  explicit SoftZCompositor(GlFunctions const& gl);
  /// `weights`: one of each layer that was drawn, at most SoftZ::kMaxLayers.
  Frame compose(LayerTargets const& layers, std::vector<LayerWeight> const& weights, SoftZ const& soft_z);

 private:
  void resize(int width, int height);

  GlFunctions const& gl_;
  GlProgram program_;
  GlVertexArray no_vertices_;
  GlFramebuffer framebuffer_;
  GlTexture color_, depth_;
  int width_ = 0, height_ = 0;
};

}  // namespace scanview
