#pragma once
#include <filesystem>
#include <string>

#include "mesh/polygon_model.h"

namespace scanview {

/// Wavefront OBJ: `v x y z [r g b]` (colours in 0..1), `f` with a, a/t, a//n, a/t/n, indices from 1 or, negative,
/// back from the latest vertex; `mtllib` and `usemtl` for what is transparent (a library that is not there is a note);
/// a backslash continues a line. All else is skipped.
PolygonModel model_from_obj(std::string text, std::filesystem::path const& path);

}  // namespace scanview
