#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "mesh/triangle_mesh.h"

namespace scanview {

/// A binary glTF file of one mesh whose primitives are runs of triangles: begins[k] is the first triangle of primitive
/// k, and the end. All share the vertices (and colours), so that a program can draw any choice of them.
std::string encode_patch_glb(TriangleMesh const& mesh, std::vector<std::uint32_t> const& begins);

}  // namespace scanview
