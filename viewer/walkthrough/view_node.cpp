#include "viewer/walkthrough/view_node.h"

#include <algorithm>

#include "mesh/node_paint.h"

namespace scanview {

NodeMesh view_node(View const& view, ViewMesh const& view_mesh, cv::Mat3b const& picture) {
  NodeMesh node;
  node.position = view.eye();
  NodeMesh::Side side;
  side.camera = view_mesh.camera;
  side.node_from_camera = view.object_from_camera->linear();
  side.color = with_gain(picture, view.gain);
  side.feather = view_mesh.feather;
  side.end = view_mesh.mesh.triangles.size();
  for (auto const& vertex : view_mesh.mesh.vertices)
    node.vertices.push_back((side.node_from_camera * vertex.cast<double>()).cast<float>());
  node.triangles = view_mesh.mesh.triangles;
  for (float const cosine : view_mesh.cos_phi) node.quality.push_back(std::clamp(cosine, 0.0F, 1.0F));
  node.sides.push_back(std::move(side));
  return node;
}

}  // namespace scanview
