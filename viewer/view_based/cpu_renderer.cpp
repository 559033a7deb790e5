#include <algorithm>
#include <cmath>

#include "viewer/raster/tile_composition.h"
#include "viewer/view_based/raster_view.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
namespace {

class CpuRenderer final : public ViewBasedRenderer {
 public:
  CpuRenderer(std::shared_ptr<ViewLibrary> library, ViewBasedOptions const& options, int threads)
      : ViewBasedRenderer(library, options), rasterizer_(threads), views_(library) {}
  BackEnd back_end() const override { return BackEnd::cpu; }

 private:
  bool ready(std::size_t view, bool wait) override { return views_.get(view, wait) != nullptr; }

  Frame draw(std::vector<UsedView> const& views, Camera const& camera,
             Eigen::Isometry3d const& object_from_camera) override {
    // The last frame's memory, where its receiver is done with it: fresh pages cost as much as a view.
    if (last_.color.u == nullptr || last_.color.u->refcount != 1 || last_.depth.u->refcount != 1 ||
        last_.color.size() != cv::Size(camera.width(), camera.height())) {
      last_ = new_frame(camera.width(), camera.height());
    }
    Frame const frame = last_;
    stages_ = {{"triangles", 0}, {"pixels", 0}};
    for (int y = 0; y < camera.height(); y += kBlock) {
      for (int x = 0; x < camera.width(); x += kBlock) {
        cv::Rect const block(x, y, std::min(kBlock, camera.width() - x), std::min(kBlock, camera.height() - y));
        draw_block(views, camera.cropped(x, y, block.width, block.height), object_from_camera, frame.color(block),
                   frame.depth(block));
      }
    }
    return frame;
  }

  void draw_block(std::vector<UsedView> const& used, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                  cv::Mat4b color, cv::Mat1f depth) {
    std::vector<LayerRasterizer::Layer> layers;
    std::vector<ComposedLayer> composed;
    double const rank = fill_rank(used);
    for (auto const& view : used) {
      RasterView const& raster = *views_.get(view.view, true);
      LayerRasterizer::Part part{&raster.mesh(), {}};
      if (!raster.transform_to(camera, object_from_camera, spacing(), options().relight, part.transform)) continue;
      LayerRasterizer::Layer layer;
      layer.parts = {part};
      layer.largest_lod = static_cast<float>(raster.texture().levels.size() - 1);
      layer.wireframe = options().wireframe;
      layers.push_back(layer);
      ComposedLayer compose;
      compose.texture = &raster.texture();
      Eigen::Vector3f const hue = view_hue(view.view);
      for (int c = 0; c < 3; ++c) {
        compose.gain[c] = raster.gain()[c];
        compose.hue[c] = hue[c];
      }
      PicturePlace const place = raster.place(camera, object_from_camera);
      for (int r = 0; r < 3; ++r) {
        for (int c = 0; c < 3; ++c) {
          compose.along[r][c] = place.along(r, c);
          compose.at[r][c] = place.at(r, c);
        }
      }
      compose.weight = static_cast<float>(view.weight);
      compose.fill = static_cast<float>(view.fill);
      compose.fill_rank = static_cast<float>(view.fill * rank);
      compose.cosine = options().cosine;
      compose.feather = options().feather;
      composed.push_back(compose);
    }
    Composition const how = composition(soft_z(used), camera);
    rasterizer_.draw(layers, camera.width(), camera.height(), [&](LayerRasterizer::Tile& tile) {
      compose_tile(tile, measured_layers(tile, composed, how), how, color, depth);
    });
    stages_["triangles"] += rasterizer_.prepare_ms();
    stages_["pixels"] += rasterizer_.tiles_ms();
  }

  LayerRasterizer rasterizer_;
  RasterViews views_;
  Frame last_;
};

}  // namespace

std::unique_ptr<ViewBasedRenderer> make_cpu_renderer(std::shared_ptr<ViewLibrary> library,
                                                     ViewBasedOptions const& options, int threads) {
  return std::make_unique<CpuRenderer>(library, options, threads);
}

}  // namespace scanview
