#include "viewer/raster/layer_rasterizer.h"

#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <stdexcept>

namespace scanview {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// Calls work(item, part) for all parts of all items.
template <typename Parts, typename Work>
void for_each_part(std::size_t items, Parts const& parts, Work const& work) {
  std::vector<std::pair<std::size_t, std::size_t>> all;
  for (std::size_t i = 0; i < items; ++i) {
    for (std::size_t p = 0; p < parts(i); ++p) all.emplace_back(i, p);
  }
  tbb::parallel_for(std::size_t{0}, all.size(), [&](std::size_t i) { work(all[i].first, all[i].second); });
}

}  // namespace

struct LayerRasterizer::Threads {
  explicit Threads(int count) : arena(count > 0 ? count : tbb::task_arena::automatic) {}
  tbb::task_arena arena;
  tbb::enumerable_thread_specific<Tile> tiles;
};

LayerRasterizer::LayerRasterizer(int threads) : threads_(std::make_unique<Threads>(threads)) {}
LayerRasterizer::~LayerRasterizer() = default;

float* LayerRasterizer::Tile::scratch(std::size_t number) {
  while (scratch_.size() <= number) scratch_.emplace_back(kTilePixels);
  return scratch_[number].data();
}

TextureTarget const& LayerRasterizer::Tile::draw(std::size_t layer, float const* where) {
  TextureTarget const& target = targets_[layer];
  constexpr float kNothing = -std::numeric_limits<float>::infinity();
  if (where == nullptr) {
    std::fill_n(target.key, kTilePixels, kNothing);
  } else {
    for (std::size_t i = 0; i < kTilePixels; ++i) target.key[i] = where[i] > 0 ? kNothing : -kNothing;
  }
  triangles_.clear();
  for (std::size_t i = first_bins_[layer]; i < first_bins_[layer + 1]; ++i) (*bins_)[i].collect(index, triangles_);
  draw_textured(triangles_.data(), triangles_.size(), area, target);
  return target;
}

void LayerRasterizer::draw(std::vector<Layer> const& layers, int width, int height,
                           std::function<void(Tile&)> const& compose) {
  if (width < 1 || height < 1 || width > kBlock || height > kBlock)
    throw std::logic_error("LayerRasterizer: a picture of no or too many pixels");
  std::vector<Part const*> parts;
  std::vector<Culling> culling;
  std::vector<std::size_t> first_bins = {0};
  for (Layer const& layer : layers) {
    for (Part const& part : layer.parts) parts.push_back(&part);
    culling.resize(parts.size(), layer.culling);
    first_bins.push_back(parts.size());
  }
  if (bins_.size() < parts.size()) bins_.resize(parts.size());
  threads_->arena.execute([&] {
    auto const start = Clock::now();
    for (std::size_t i = 0; i < parts.size(); ++i) {
      bins_[i].begin(*parts[i]->mesh, parts[i]->transform, width, height, culling[i]);
    }
    for_each_part(
        parts.size(), [&](std::size_t i) { return bins_[i].vertex_parts(); },
        [&](std::size_t i, std::size_t part) { bins_[i].transform(part); });
    for_each_part(
        parts.size(), [&](std::size_t i) { return bins_[i].triangle_parts(); },
        [&](std::size_t i, std::size_t part) { bins_[i].bin(part); });
    prepare_ms_ = milliseconds_since(start);

    auto const drawing = Clock::now();
    int const across = (width + kTileWidth - 1) / kTileWidth, down = (height + kTileHeight - 1) / kTileHeight;
    tbb::parallel_for(0, across * down, [&](int index) {
      Tile& tile = threads_->tiles.local();
      int const left = index % across * kTileWidth, top = index / across * kTileHeight;
      tile.area = {left, top, std::min(left + kTileWidth, width), std::min(top + kTileHeight, height)};
      tile.index = static_cast<std::size_t>(index);
      tile.of_ = &layers;
      tile.bins_ = &bins_;
      tile.first_bins_ = first_bins;
      tile.targets_.resize(layers.size());
      while (tile.words_.size() < layers.size()) {
        tile.floats_.emplace_back(3 * kTilePixels);
        tile.words_.emplace_back(2 * kTilePixels);
      }
      for (std::size_t i = 0; i < layers.size(); ++i) {
        float* const floats = tile.floats_[i].data();
        std::uint32_t* const words = tile.words_[i].data();
        tile.targets_[i] = {floats,
                            floats + kTilePixels,
                            floats + 2 * kTilePixels,
                            words,
                            words + kTilePixels,
                            layers[i].largest_lod,
                            layers[i].wireframe,
                            layers[i].parts.front().transform.lit,
                            layers[i].parts.front().transform.perspective};
      }
      compose(tile);
    });
    tiles_ms_ = milliseconds_since(drawing);
  });
}

}  // namespace scanview
