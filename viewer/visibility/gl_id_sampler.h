#pragma once
#include <Eigen/Geometry>
#include <memory>

#include "mesh/triangle_mesh.h"
#include "viewer/gl/gl_objects.h"
#include "viewer/raster/id_buffer.h"
#include "viewer/visibility/sample_camera.h"

namespace scanview {

/// Draws which triangles a camera sees with OpenGL, beside TriangleSampler's rasteriser: identifiers in 32 bits and
/// depths in single precision. The same transform and the same grid of 1/256 pixel; pixels whose centre lies on an
/// edge, and surfaces that touch, may fall the other way.
class GlIdSampler {
 public:
  /// Mesh as drawn_mesh() gives it; it is copied to the context, which must outlive the sampler and is made current by
  /// it. Throws Error{io} where OpenGL fails.
  GlIdSampler(GlContext& context, TriangleMesh const& drawn);
  ~GlIdSampler();
  GlIdSampler(GlIdSampler const&) = delete;
  GlIdSampler& operator=(GlIdSampler const&) = delete;

  /// Both sides of all triangles; ids number them. Valid until the next call. Throws Error{bad_input} for a picture
  /// larger than OpenGL can draw, Error{io} where it fails.
  IdBuffer const& draw(SampleCamera const& sample);

 private:
  void resize(int width, int height);

  GlContext& context_;
  GlFunctions gl_;
  Eigen::AlignedBox3d bounds_;
  GLsizei indices_ = 0;
  IdBuffer picture_;
  struct Objects;
  std::unique_ptr<Objects> objects_;
};

}  // namespace scanview
