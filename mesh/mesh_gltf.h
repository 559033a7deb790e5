#pragma once
#include <filesystem>
#include <string_view>

#include "mesh/polygon_model.h"

namespace scanview {

/// glTF 2.0, the JSON text or a GLB file: the triangles, strips and fans of the default scene (of all root nodes where
/// there is none), placed by their nodes, in metres and y up as the file has them; turned where a node mirrors them.
/// Vertices of equal positions are joined. Skins and morph targets stay in the pose they were modelled in; colours and
/// textures are not read; points and lines are left out, each with a note. Throws Error{bad_input, path}: what glTF
/// forbids, compression (Draco, meshopt), sparse accessors, and instances of more than 2^25 triangles or vertices
/// altogether.
PolygonModel model_from_gltf(std::string_view bytes, std::filesystem::path const& path);

}  // namespace scanview
