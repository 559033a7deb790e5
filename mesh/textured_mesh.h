#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "mesh/view_mesh.h"

namespace scanview {

/// A view's mesh as programs without projective texture coordinates can draw it: triangles split until plain (s, t) are
/// nowhere more than half a texel off, the picture cropped to the object and padded beyond it, so that filtering never
/// fetches background.
struct TexturedMesh {
  TriangleMesh mesh;                   ///< camera coordinates
  std::vector<Eigen::Vector2f> plain;  ///< a vertex: (s, t), t down, over `picture`
  cv::Mat3b picture;                   ///< empty where the view has no colour
};
TexturedMesh textured_mesh(ViewMesh const& view_mesh, View const& view);

/// The part of the picture that the mesh covers, and `margin` pixels around it, inside the picture.
cv::Rect covered_rectangle(ViewMesh const& view_mesh, int margin);

/// Wavefront OBJ: the mesh in object coordinates (of a view without a pose in its camera's), y and z as they are, with
/// a material of the file NAME.jpg. Unlit: ambient white, no diffuse.
struct ObjFiles {
  std::string obj, mtl, jpeg;  ///< NAME.obj, NAME.mtl, NAME.jpg; without colour mtl and jpeg are empty
};
ObjFiles encode_obj(ViewMesh const& view_mesh, View const& view);

}  // namespace scanview
