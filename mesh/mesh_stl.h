#pragma once
#include <filesystem>
#include <string_view>

#include "mesh/polygon_model.h"

namespace scanview {

/// Whether the length is what the count of a binary STL file says: then it is one, even where it begins with "solid".
bool is_binary_stl(std::string_view bytes);

/// Stereolithography, text or binary. Corners of equal positions become one vertex; colours in the attributes are
/// skipped. Throws Error{bad_input, path}.
PolygonModel model_from_stl(std::string_view bytes, std::filesystem::path const& path);

}  // namespace scanview
