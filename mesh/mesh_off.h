#pragma once
#include <filesystem>
#include <string_view>

#include "mesh/polygon_model.h"

namespace scanview {

/// Whether the text, after comments, begins with [ST][C][N][4][n]OFF.
bool is_off(std::string_view bytes);

/// Geomview's object file format, a vertex and a face a line, or binary; the keyword may be missing. Colours of
/// vertices are integers to 255 or reals to 1. Faces of fewer than three vertices (points and lines) are left out with
/// a note. Throws Error{bad_input, path}.
PolygonModel model_from_off(std::string_view bytes, std::filesystem::path const& path);

}  // namespace scanview
