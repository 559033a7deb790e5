#pragma once
#include "mesh/node_mesh.h"
#include "viewer/view_based/view_library.h"

namespace scanview {

/// A view of a set as a node of one side: its mesh, its picture with its gain, its cosines as qualities. The view must
/// have a pose and a perspective camera. `picture`: padded_texture() of the view.
NodeMesh view_node(View const& view, ViewMesh const& view_mesh, cv::Mat3b const& picture);

}  // namespace scanview
