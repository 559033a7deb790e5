#pragma once
#include <filesystem>

#include "mesh/node_mesh.h"

namespace scanview {

/// A node as a folder: node.json (position, sides, their cameras and how many of the triangles are theirs), mesh.ply
/// (node coordinates, with `quality` a triangle), panes.ply where it has some, and color_K.png and feather_K.png of
/// side K. Written whole or not at all.
void write_node_mesh(std::filesystem::path const& folder, NodeMesh const& node);

/// Throws Error{bad_input} that names the file which is missing, truncated, or does not fit the others.
NodeMesh read_node_mesh(std::filesystem::path const& folder);

}  // namespace scanview
