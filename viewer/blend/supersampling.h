#pragma once
#include "viewer/renderer.h"

namespace scanview {

/// The mean of factor × factor pixels of a larger picture, in linear light, colours weighted by their alpha, so that
/// the background does not bleed in. A depth is the nearest of those drawn. The frame's size must be a multiple of
/// factor.
Frame box_filtered(Frame const& frame, int factor);

/// Smooth outlines: pixels on a border (of the object, or between near and far) become the mean of factor × factor
/// samples; all others stay as they are, at their centre, so that no detail of a texture is lost. Draws two pictures,
/// at 1 + factor² times the cost. The renderer must outlive it. factor 1 changes nothing; at most 8 (Error{usage}).
class SupersamplingRenderer : public Renderer {
 public:
  SupersamplingRenderer(Renderer& renderer, int factor);
  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override;

 private:
  Renderer& renderer_;
  int factor_;
};

}  // namespace scanview
