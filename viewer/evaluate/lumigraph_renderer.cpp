#include "viewer/evaluate/lumigraph_renderer.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/error.h"
#include "viewer/raster/tile_composition.h"
#include "viewer/view_based/raster_view.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

constexpr double kAllAlike = std::numeric_limits<double>::infinity();  ///< no nearness: the penalty does that here

class LumigraphRenderer final : public HeldOutRenderer {
 public:
  LumigraphRenderer(std::shared_ptr<ViewLibrary> library, LumigraphOptions const& options)
      : library_(library), options_(options), rasterizer_(0), views_(library) {
    if (options_.threshold < 0) options_.threshold = default_threshold(*library_);
    exclude({});
  }

  void exclude(std::vector<std::size_t> const& views) override {
    used_.clear();
    for (std::size_t i = 0; i < library_->meshes().size(); ++i) {
      if (library_->meshes()[i].mesh.triangles.empty()) continue;
      if (std::find(views.begin(), views.end(), i) == views.end()) used_.push_back(i);
    }
    if (used_.empty()) throw Error(ErrorCode::bad_input, {}, "no view with a mesh is left to render from");
  }

  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    if (std::max(camera.width(), camera.height()) > kBlock)
      throw Error(ErrorCode::usage, {}, "the lumigraph draws pictures of at most 4096 pixels each way");
    std::vector<LayerRasterizer::Layer> layers;
    std::vector<ComposedLayer> composed;
    std::vector<Source> sources;
    for (std::size_t const view : used_) {
      RasterView const* const raster = views_.get(view, true);
      LayerRasterizer::Part part;
      if (raster == nullptr || !raster->transform_to(camera, object_from_camera, kAllAlike, false, part.transform))
        continue;
      part.mesh = &raster->mesh();
      LayerRasterizer::Layer layer;
      layer.parts = {part};
      layer.largest_lod = static_cast<float>(raster->texture().levels.size() - 1);
      layers.push_back(layer);
      ComposedLayer compose;
      compose.texture = &raster->texture();
      for (int c = 0; c < 3; ++c) compose.gain[c] = raster->gain()[c];
      compose.weight = 1;
      composed.push_back(compose);
      View const& of = library_->set().views[view];
      sources.push_back({of.image.camera, object_from_camera.inverse() * *of.object_from_camera});
    }
    Frame const frame = new_frame(camera.width(), camera.height());
    // Whatever has a weight is mixed: what is hidden has been taken out before.
    Composition how;
    how.threshold = 1e30F;
    how.ramp = 1e-30F;
    how.good_enough = how.good_quality = how.fair_feather = 1;
    how.least_weight = static_cast<float>(SoftZ::kLeastQuality);
    how.perspective = camera.is_perspective();
    rasterizer_.draw(layers, camera.width(), camera.height(), [&](LayerRasterizer::Tile& tile) {
      auto of_tile = measured_layers(tile, composed, how);
      weigh(camera, sources, tile.area, of_tile);
      compose_tile(tile, of_tile, how, frame.color, frame.depth);
    });
    return frame;
  }

 private:
  struct Source {
    Camera camera;
    Eigen::Isometry3d camera_from_source;
    /// Unit, from a point towards the camera.
    Vector3d towards(Vector3d const& p) const {
      return camera.is_perspective() ? Vector3d((camera_from_source.translation() - p).normalized())
                                     : Vector3d(-camera_from_source.linear().col(2));
    }
    double pixel_size(Vector3d const& p) const { return camera.pixel_size((camera_from_source.inverse() * p).z()); }
  };
  struct Sample {
    std::size_t layer = 0;
    double depth = 0, quality = 0, penalty = 0;
  };

  /// Replaces each layer's quality by its lumigraph weight, as shares of the pixel.
  void weigh(Camera const& camera, std::vector<Source> const& sources, TileArea const& area,
             std::vector<ComposedLayer>& layers) const {
    std::vector<Sample> samples, seen;
    for (int y = area.top; y < area.bottom; ++y) {
      for (int x = area.left; x < area.right; ++x) {
        auto const at = static_cast<std::size_t>((y - area.top) * kTileStride + (x - area.left));
        samples.clear();
        for (std::size_t i = 0; i < layers.size(); ++i) {
          float const quality = layers[i].quality[at], key = layers[i].samples.key[at];
          if (quality > 0) samples.push_back({i, camera.is_perspective() ? 1 / key : -key, quality, 0});
          layers[i].quality[at] = 0;
        }
        if (samples.empty()) continue;
        find_seen(samples, seen);
        double nearest = std::numeric_limits<double>::infinity();
        for (auto const& sample : seen) nearest = std::min(nearest, sample.depth);
        Vector3d const p = camera.unproject(x, y, nearest);
        Vector3d const to_eye = camera.is_perspective() ? Vector3d(-p.normalized()) : Vector3d(0, 0, -1);
        for (auto& sample : seen) {
          Source const& source = sources[sample.layer];
          Vector3d const to_view = source.towards(p);
          double const angle = std::atan2(to_view.cross(to_eye).norm(), to_view.dot(to_eye));
          double const ratio = source.pixel_size(p) / camera.pixel_size(nearest);
          sample.penalty = options_.angle * angle + options_.resolution * std::max(0.0, ratio - 1);
        }
        std::stable_sort(seen.begin(), seen.end(),
                         [](Sample const& a, Sample const& b) { return a.penalty < b.penalty; });
        auto const k = std::min(seen.size(), static_cast<std::size_t>(options_.views));
        double const inverse_limit = k < seen.size() ? 1 / std::max(seen[k].penalty, 1e-9) : 0;
        double sum = 0;
        for (std::size_t i = 0; i < k; ++i) {
          double const penalty = std::max(seen[i].penalty, 1e-9);
          seen[i].quality = std::max(0.0, 1 - penalty * inverse_limit) / penalty;
          sum += seen[i].quality;
        }
        for (std::size_t i = 0; i < k; ++i) {
          // All k + 1 at one penalty: alike.
          double const share = sum > 0 ? seen[i].quality / sum : 1.0 / static_cast<double>(k);
          layers[seen[i].layer].quality[at] = static_cast<float>(share);
        }
      }
    }
  }

  /// The samples that are less than half hidden, by SoftZ.
  void find_seen(std::vector<Sample> const& samples, std::vector<Sample>& seen) const {
    double const threshold = options_.threshold, ratio = ViewBasedOptions().reliability_ratio;
    auto const hide = [&](double distance) {
      return threshold > 0 ? std::clamp((distance - threshold) * 2 / threshold, 0.0, 1.0) : distance > 0 ? 1.0 : 0.0;
    };
    auto const reliable = [&](Sample const& i) {
      double doubt = 0;
      for (auto const& j : samples) {
        doubt =
            std::max(doubt, hide(j.depth - i.depth) * std::clamp(2 - 2 * i.quality / (ratio * j.quality), 0.0, 1.0));
      }
      return 1 - doubt;
    };
    seen.clear();
    for (auto const& k : samples) {
      double hidden = 1 - reliable(k);
      for (auto const& i : samples) {
        if (double const behind = hide(k.depth - i.depth); behind > hidden)
          hidden = std::max(hidden, reliable(i) * behind);
      }
      if (hidden < 0.5) seen.push_back(k);
    }
    if (seen.empty()) {
      seen.push_back(*std::max_element(samples.begin(), samples.end(),
                                       [](Sample const& a, Sample const& b) { return a.quality < b.quality; }));
    }
  }

  std::shared_ptr<ViewLibrary> library_;
  LumigraphOptions options_;
  LayerRasterizer rasterizer_;
  RasterViews views_;
  std::vector<std::size_t> used_;
};

}  // namespace

std::unique_ptr<HeldOutRenderer> make_lumigraph_renderer(std::shared_ptr<ViewLibrary> library,
                                                         LumigraphOptions const& options) {
  return std::make_unique<LumigraphRenderer>(std::move(library), options);
}

}  // namespace scanview
