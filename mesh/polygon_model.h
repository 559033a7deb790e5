#pragma once
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "mesh/model_textures.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// A polygon model as its file holds it, in triangles. A polygon of n corners is n − 2 triangles: a fan about its first
/// corner, or, where it is concave, ears cut off.
struct PolygonModel {
  TriangleMesh mesh;
  std::vector<std::int32_t>
      polygons;  ///< the polygon each triangle is a part of, ascending from 0; empty: each its own
  std::vector<std::uint8_t> transparent;  ///< 1: light passes through the triangle; empty: through none
  ModelTextures textures;                 ///< pictures on its triangles; empty where the file has none
  std::vector<std::string> notes;         ///< what was changed or left out on the way, one line each, for a person

  std::size_t polygon_count() const;
};

/// Which side of the triangles is outside. `automatic`: as the file has it, but all are turned where the model shows
/// its back (`is_wound_inwards`). `flip`: the other side than the file says.
enum class Winding { automatic, keep, flip };

/// Reads PLY, OBJ, OFF, STL, glTF and GLB, MNI polygons (.obj, .txt) and FreeSurfer triangle surfaces, also gzipped,
/// recognised by their first bytes and, where these do not tell, by the file's ending. Vertices of equal positions are
/// joined in STL and glTF, which cannot share them, and nowhere else. Transparent are: PLY with `alpha` below 255, OBJ
/// with a material of `d` below 1 (or `Tr` above 0) or with a `map_d`, OFF and MNI with an alpha or opacity below 1,
/// glTF with the alpha modes BLEND and MASK or with transmission. Materials, buffers and pictures in files of their own
/// are looked for in the model's folder and below it.
///
/// Textures are OBJ's map_Kd (alone: Kd does not tint it), glTF's baseColorTexture and PLY's TextureFile. A picture
/// that is missing or damaged, or a face whose texture coordinates are, is a note, and the plain colour stands in.
/// Plain colours of materials (Kd, as sRGB; baseColorFactor) become the vertices' where the file has none of its own
/// (`colored_by_materials`). Throws Error{bad_input} that names the file: damaged or cut off, of
/// no kind we read, without polygons, with an index out of range or a vertex that is not finite.
PolygonModel read_polygon_model(std::filesystem::path const& path, Winding winding = Winding::automatic);

/// The same from a file's bytes; its name tells the ending, the folder, and stands in errors. The winding is kept, and
/// no polygons is no error.
PolygonModel parse_polygon_model(std::string bytes, std::filesystem::path const& path);

}  // namespace scanview
