#pragma once
#include <filesystem>

#include "viewer/visibility/visibility_field.h"

namespace scanview {

/// Writes a .vis file: a line "scanview visibility 1", a line of JSON (method, patches, lookup, the model's hash), the
/// coded bits (bit_coding.h) and their check sum. Patches are not in it: they follow from the model.
/// mesh: of the model.
void write_visibility(std::filesystem::path const& path, VisibilityField const& field, TriangleMesh const& mesh);
std::string format_visibility(VisibilityField const& field, TriangleMesh const& mesh);

/// For the model it was made of. Throws Error{bad_input} that tells what is wrong: another model, another version of
/// the patches, a damaged or cut off file.
VisibilityField read_visibility(std::filesystem::path const& path, PolygonModel const& model);
VisibilityField parse_visibility(std::string_view bytes, PolygonModel const& model, std::filesystem::path const& path);

}  // namespace scanview
