#pragma once
#include <vector>

#include "viewer/blend/soft_z.h"
#include "viewer/raster/layer_rasterizer.h"
#include "viewer/renderer.h"

namespace scanview {

/// A frame of a size, of any content.
Frame new_frame(int width, int height);

/// SoftZ for the kernels: infinite and zero thresholds stay finite and mean the same.
Composition composition(SoftZ const& soft_z, Camera const& camera);

/// Draws all layers of a tile, each with the picture that `layers` says, and measures their quality.
std::vector<ComposedLayer> measured_layers(LayerRasterizer::Tile& tile, std::vector<ComposedLayer> layers,
                                           Composition const& how);

/// Mixes them into the tile's part of a frame.
void compose_tile(LayerRasterizer::Tile const& tile, std::vector<ComposedLayer> const& layers, Composition const& how,
                  cv::Mat4b color, cv::Mat1f depth);

}  // namespace scanview
