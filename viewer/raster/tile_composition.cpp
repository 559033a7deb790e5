#include "viewer/raster/tile_composition.h"

#include <algorithm>

namespace scanview {

Frame new_frame(int width, int height) {
  Frame frame;
  frame.color.create(height, width);
  frame.depth.create(height, width);
  return frame;
}

Composition composition(SoftZ const& soft_z, Camera const& camera) {
  constexpr double kLargest = 1e30;
  double const threshold = std::min(soft_z.threshold, kLargest);
  Composition how;
  how.threshold = static_cast<float>(threshold);
  how.ramp = static_cast<float>(threshold > 0 ? std::min(2 / threshold, kLargest) : kLargest);
  how.reliability_ratio = static_cast<float>(soft_z.reliability_ratio);
  how.good_enough = static_cast<float>(SoftZ::kGoodEnough);
  how.good_at_zero = static_cast<float>(SoftZ::kGoodAtZero);
  how.good_quality = static_cast<float>(SoftZ::kGoodQuality);
  how.fair_feather = static_cast<float>(SoftZ::kFairFeather);
  how.always = static_cast<float>(soft_z.always);
  how.agree = true;
  how.least_weight = static_cast<float>(SoftZ::kLeastQuality);
  how.nearest = soft_z.nearest;
  how.show = static_cast<int>(soft_z.show);
  how.perspective = camera.is_perspective();
  return how;
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
