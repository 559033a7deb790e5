#pragma once
#include <vector>

#include "viewer/blend/layer_targets.h"
#include "viewer/blend/soft_z.h"
#include "viewer/renderer.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {

/// The picture that belongs to a layer.
struct LayerPicture {
  GLuint texture = 0;
  Eigen::Vector2f size;  ///< texels
  Eigen::Vector3f gain;
  PicturePlace place;
};

/// SoftZ with OpenGL: a pass over the picture for each layer adds up colours, a last one divides.
class SoftZCompositor {
 public:
  explicit SoftZCompositor(GlFunctions const& gl);
  /// `weights`, `pictures`: one of each layer that was drawn, at most SoftZ::kMaxLayers.
  Frame compose(LayerTargets const& layers, std::vector<LayerWeight> const& weights,
                std::vector<LayerPicture> const& pictures, SoftZ const& soft_z);

 private:
  void resize(int width, int height);
  void set_weights(std::vector<LayerWeight> const& weights, SoftZ const& soft_z);

  GlFunctions const& gl_;
  GlProgram add_, resolve_;
  GlVertexArray no_vertices_;
  GlFramebuffer sums_framebuffer_, framebuffer_;
  GlTexture sums_, sums_depth_, color_, depth_;
  int width_ = 0, height_ = 0;
};

}  // namespace scanview
