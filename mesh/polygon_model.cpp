#include "mesh/polygon_model.h"

#include <algorithm>
#include <cctype>
#include <string_view>
#include <utility>

#include "base/error.h"
#include "base/files.h"
#include "mesh/gzip.h"
#include "mesh/inward_winding.h"
#include "mesh/mesh_freesurfer.h"
#include "mesh/mesh_gltf.h"
#include "mesh/mesh_mni.h"
#include "mesh/mesh_obj.h"
#include "mesh/mesh_off.h"
#include "mesh/mesh_ply.h"
#include "mesh/mesh_stl.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

enum class Kind { ply, obj, off, stl, gltf, mni_polygons, freesurfer, unknown };

Kind kind_by_content(std::string_view bytes) {
  if (bytes.starts_with("ply\n") || bytes.starts_with("ply\r")) return Kind::ply;
  if (bytes.starts_with("glTF")) return Kind::gltf;
  if (is_freesurfer_surface(bytes)) return Kind::freesurfer;
  if (is_mni_polygons(bytes)) return Kind::mni_polygons;
  if (is_off(bytes)) return Kind::off;
  return Kind::unknown;
}

Kind kind_by_ending(std::string ending) {
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return char(std::tolower(c)); });
  if (ending == ".ply") return Kind::ply;
  if (ending == ".obj") return Kind::obj;
  if (ending == ".off") return Kind::off;
  if (ending == ".stl") return Kind::stl;
  if (ending == ".gltf" || ending == ".glb") return Kind::gltf;
  return Kind::unknown;
}

}  // namespace

std::size_t PolygonModel::polygon_count() const {
  return polygons.empty() ? mesh.triangles.size() : std::size_t(polygons.back()) + 1;
}

PolygonModel parse_polygon_model(std::string bytes, fs::path const& path) {
  bool const named_gzip = path.extension() == ".gz";
  if (named_gzip || is_gzip(bytes)) bytes = unpack_gzip(bytes, path);
  // Eighty bytes of a binary STL header may say anything.
  Kind kind = is_binary_stl(bytes) ? Kind::stl : kind_by_content(bytes);
  if (kind == Kind::unknown) kind = kind_by_ending((named_gzip ? path.stem() : path).extension().string());
  switch (kind) {
    case Kind::ply:
      return model_from_ply(parse_ply(bytes, path), path);
    case Kind::obj:
      return model_from_obj(std::move(bytes), path);
    case Kind::off:
      return model_from_off(bytes, path);
    case Kind::stl:
      return model_from_stl(bytes, path);
    case Kind::gltf:
      return model_from_gltf(bytes, path);
    case Kind::mni_polygons:
      return model_from_mni_polygons(bytes, path);
    case Kind::freesurfer:
      return model_from_freesurfer(bytes, path);
    case Kind::unknown:
      break;
  }
  throw Error(
      ErrorCode::bad_input, path,
      "not a model we read: PLY, OBJ, OFF, STL, glTF, GLB, MNI polygons, FreeSurfer surface, or one of them gzipped");
}

PolygonModel read_polygon_model(fs::path const& path, Winding winding) {
  PolygonModel model = parse_polygon_model(read_file(path), path);
  if (model.mesh.triangles.empty()) throw Error(ErrorCode::bad_input, path, "holds no polygons");
  bool const inwards = winding == Winding::automatic && is_wound_inwards(model.mesh);
  if (inwards || winding == Winding::flip) {
    model.mesh = turned(std::move(model.mesh));
    model.textures.turn_from(0);
    model.notes.push_back(inwards ? "wound inwards: all triangles were turned" : "all triangles were turned, as asked");
  }
  return model;
}

}  // namespace scanview
