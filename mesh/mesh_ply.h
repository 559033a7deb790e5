#pragma once
#include <filesystem>

#include "base/ply.h"
#include "mesh/polygon_model.h"

namespace scanview {

/// Elements vertex (x, y, z; red, green, blue of type uchar where they are there; alpha), face (vertex_indices; alpha)
/// and tristrips. Throws Error{bad_input, path} for what is missing, out of range or not finite.
PolygonModel model_from_ply(PlyFile const& ply, std::filesystem::path const& path);

/// Elements vertex (float x, y, z; uchar red, green, blue) and face (list uchar int vertex_indices).
PlyFile ply_from_mesh(TriangleMesh const& mesh);

}  // namespace scanview
