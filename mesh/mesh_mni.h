#pragma once
#include <filesystem>
#include <string_view>

#include "mesh/polygon_model.h"

namespace scanview {

/// Whether the text begins with a P and a number.
bool is_mni_polygons(std::string_view bytes);

/// The polygons of the Montreal Neurological Institute's tools (.obj, as text): `P ambient diffuse specular shininess
/// opacity points`, the points, their normals, the count of polygons, the kind of colours (0: one for all, 1: one a
/// polygon, 2: one a point) and the colours (red, green, blue, alpha in 0..1), where each polygon's indices end, and
/// the indices. Colours of points are read. Throws Error{bad_input, path}.
PolygonModel model_from_mni_polygons(std::string_view text, std::filesystem::path const& path);

}  // namespace scanview
