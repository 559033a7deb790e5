#include "viewer/raster/tile_composition.h"

namespace scanview {

Frame new_frame(int width, int height) {
  Frame frame;
  frame.color.create(height, width);
  frame.depth.create(height, width);
  return frame;
}

std::vector<ComposedLayer> measured_layers(LayerRasterizer::Tile& tile, std::vector<ComposedLayer> layers,
                                           Composition const& how) {
  for (std::size_t i = 0; i < layers.size(); ++i) {
    layers[i].samples = tile.draw(i);
    layers[i].quality = tile.scratch(2 * i);
    layers[i].fairness = tile.scratch(2 * i + 1);
    measure_quality(layers[i], how, tile.area);
  }
  return layers;
}

void compose_tile(LayerRasterizer::Tile const& tile, std::vector<ComposedLayer> const& layers, Composition const& how,
                  cv::Mat4b color, cv::Mat1f depth) {
  auto* const pixels = reinterpret_cast<std::uint32_t*>(color.ptr(tile.area.top)) + tile.area.left;
  compose_layers(layers.data(), layers.size(), how, tile.area, pixels, color.step1() / 4,
                 depth.ptr<float>(tile.area.top) + tile.area.left, depth.step1());
}

}  // namespace scanview
