#include "base/files.h"
#include "mesh/mesh_ply.h"
#include "mesh/polygon_model.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

TriangleMesh read_triangle_mesh(std::filesystem::path const& path) {
  return parse_polygon_model(read_file(path), path).mesh;
}

void write_triangle_mesh(std::filesystem::path const& path, TriangleMesh const& mesh) {
  mesh.check();
  write_file(path, format_ply(ply_from_mesh(mesh), PlyFormat::binary_little_endian));
}

}  // namespace scanview
