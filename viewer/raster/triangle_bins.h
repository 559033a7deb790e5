#pragma once
#include <cstdint>
#include <vector>

#include "mesh/triangle_mesh.h"
#include "viewer/raster/raster_types.h"

namespace scanview {

/// A mesh as the rasteriser reads it: three vertex indices a triangle, and its label (ScreenTriangle).
struct RasterMesh {
  VertexArrays vertices;
  std::vector<std::int32_t> corners;
  std::vector<std::uint32_t> labels;
};

/// `labels`: one a triangle.
RasterMesh raster_mesh(TriangleMesh const& mesh, std::vector<std::uint32_t> labels);

/// Of triangles that turn their back: left out; drawn as the others; or drawn under the label 0, so that they hide what
/// is behind them.
enum class Culling { back_faces, none, backs_hide };

/// The triangles of one mesh, as seen by one camera, sorted by the tiles of the picture that they touch; in the order
/// of the mesh within each tile, whatever the number of threads. Triangles that cover no pixel centre are left out,
/// those that cross the near plane or the guard band clipped.
///
/// Used in two steps, whose parts may run in parallel: every vertex_parts(), then every triangle_parts().
class TriangleBins {
 public:
  void begin(RasterMesh const& mesh, ScreenTransform const& transform, int width, int height, Culling culling);
  std::size_t vertex_parts() const;
  void transform(std::size_t part);
  std::size_t triangle_parts() const { return parts_; }
  void bin(std::size_t part);
  /// Appends the triangles that touch a tile.
  void collect(std::size_t tile, std::vector<ScreenTriangle>& out) const;

 private:
  struct Clipped {
    ScreenVertex corners[3];
    std::uint32_t label;
  };
  struct Part {
    std::vector<std::uint32_t> entries;  ///< by tile: triangles, or kClipped + index into `clipped`
    std::vector<std::uint32_t> begins;   ///< a tile, and the end
    std::vector<std::pair<std::uint32_t, std::uint32_t>> unsorted;  ///< tile, entry
    std::vector<Clipped> clipped;
  };
  void add(Part& part, ScreenVertex const& a, ScreenVertex const& b, ScreenVertex const& c, std::uint32_t entry) const;
  void clip(Part& part, std::size_t triangle) const;

  RasterMesh const* mesh_ = nullptr;
  ScreenTransform transform_;
  Culling culling_ = Culling::back_faces;
  int width_ = 0, height_ = 0, tiles_x_ = 0, tiles_y_ = 0;
  std::vector<ScreenVertex> vertices_;
  std::vector<Part> part_;  ///< kept between frames, for their memory
  std::size_t parts_ = 0;
};

}  // namespace scanview
