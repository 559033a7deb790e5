#pragma once
#include <functional>
#include <memory>
#include <vector>

#include "viewer/raster/kernels.h"
#include "viewer/raster/triangle_bins.h"

namespace scanview {

/// Draws several layers, each of one mesh or of several that hide one another, tile by tile: all layers of a tile are
/// composed while they are in cache, and no layer is ever stored whole. Vertices, triangles and tiles are each shared
/// out among the threads.
class LayerRasterizer {
 public:
  /// threads: at most so many; 0: all processors.
  explicit LayerRasterizer(int threads);
  ~LayerRasterizer();

  struct Part {
    RasterMesh const* mesh = nullptr;
    ScreenTransform transform;
  };
  struct Layer {
    std::vector<Part> parts;  ///< whose transforms agree on perspective and light; at least one
    float largest_lod = 0;
    bool wireframe = false;
    Culling culling = Culling::back_faces;
  };

  /// The buffers of one tile. Rows are kTileStride apart; vectors may be read past the last column.
  class Tile {
   public:
    TileArea area;
    std::size_t index = 0;
    std::size_t layers() const { return targets_.size(); }
    /// Draws a layer and gives its samples. With `where`, only pixels are drawn that have a positive value there; the
    /// others have an infinite key.
    TextureTarget const& draw(std::size_t layer, float const* where = nullptr);
    /// Room for one value a pixel, of any content; valid until the tile is done.
    float* scratch(std::size_t number);

   private:
    friend class LayerRasterizer;
    std::vector<Layer> const* of_ = nullptr;
    std::vector<TriangleBins> const* bins_ = nullptr;  ///< of all parts, layer after layer
    std::vector<std::size_t> first_bins_;              ///< a layer, and the end
    std::vector<TextureTarget> targets_;
    std::vector<ScreenTriangle> triangles_;
    std::vector<std::vector<float>> floats_;
    std::vector<std::vector<std::uint32_t>> words_;
    std::vector<std::vector<float>> scratch_;
  };

  /// Calls `compose` for every tile of the picture, several at a time. width, height: at most kBlock.
  void draw(std::vector<Layer> const& layers, int width, int height, std::function<void(Tile&)> const& compose);
  /// Milliseconds of the last draw(): vertices and bins; tiles.
  double prepare_ms() const { return prepare_ms_; }
  double tiles_ms() const { return tiles_ms_; }

  static constexpr std::size_t kTilePixels = static_cast<std::size_t>(kTileStride) * kTileHeight;

 private:
  struct Threads;
  std::unique_ptr<Threads> threads_;
  std::vector<TriangleBins> bins_;
  double prepare_ms_ = 0, tiles_ms_ = 0;
};

}  // namespace scanview
