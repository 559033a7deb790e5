#pragma once
#include <Eigen/Geometry>

#include "acquire/scan_set.h"
#include "mesh/view_mesh.h"
#include "viewer/blend/soft_z_compositor.h"
#include "viewer/gl/gl_objects.h"
#include "viewer/view_based/picture_pyramid.h"

namespace scanview {

/// One view on the GPU: its triangles, picture (sRGB, with mipmaps), feather and cosines.
class GpuView {
 public:
  /// Throws Error{bad_input} where sizes do not fit each other or exceed what OpenGL can do here.
  GpuView(GlFunctions const& gl, View const& view, ViewMesh const& view_mesh, PicturePyramid const& pyramid,
          std::optional<CameraLight> const& light);
  /// Where the compositor finds the picture.
  void place(Camera const& camera, Eigen::Isometry3d const& object_from_camera, LayerPicture& picture) const;

 private:
  friend class ViewPass;
  Camera camera_;
  Eigen::Isometry3d object_from_camera_;
  cv::Rect area_;
  int levels_ = 0;
  Eigen::Vector3f gain_;
  std::optional<CameraLight> light_;
  Eigen::AlignedBox3d bounds_;  ///< of the vertices, in the view's camera coordinates
  GLsizei index_count_ = 0;
  GlVertexArray vertex_array_;
  GlBuffer vertices_, normals_, logarithms_, indices_, cos_phi_;
  GlTexture picture_, feather_, cos_phi_texture_;
};

/// Draws single views with projective texture (Darsa 1998, appendix): the vertex shader takes homogeneous texture
/// coordinates from the source camera, and each fragment divides.
class ViewPass {
 public:
  explicit ViewPass(GlFunctions const& gl);
  /// Into the framebuffer that is bound (LayerTargets::begin_layer). Back faces are culled. False (and nothing is
  /// drawn) where all of the view lies behind the camera.
  struct Look {
    bool cosine = true, feather = true;  ///< whether they count in the weight
    bool wireframe = false;              ///< edges over the picture, in its false colour
    bool relight = true;                 ///< as far as there is a CameraLight
    double spacing = 1;                  ///< of neighbouring views, radians
  };
  bool draw(GpuView const& view, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
            Look const& look) const;
  /// Whether draw() would draw something: cheap.
  static bool in_front(GpuView const& view, Camera const& camera, Eigen::Isometry3d const& object_from_camera);

 private:
  GlFunctions const& gl_;
  GlProgram program_;
};

}  // namespace scanview
