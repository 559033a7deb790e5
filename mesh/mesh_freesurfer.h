#pragma once
#include <filesystem>
#include <string_view>

#include "mesh/polygon_model.h"

namespace scanview {

/// Whether the bytes begin with one of the magic numbers of FreeSurfer's surfaces.
bool is_freesurfer_surface(std::string_view bytes);

/// FreeSurfer's triangle surface: FF FF FE, a line on who made it and an empty one, then, the first byte the highest,
/// the counts of vertices and triangles, three floats a vertex, three indices a triangle. What follows (tags) is
/// skipped. The older surfaces of quadrangles are refused. Throws Error{bad_input, path}.
PolygonModel model_from_freesurfer(std::string_view bytes, std::filesystem::path const& path);

}  // namespace scanview
