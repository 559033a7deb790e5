#include "viewer/walkthrough/walkthrough_renderer.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/error.h"
#include "viewer/raster/tile_composition.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/walkthrough/gap_interpolation.h"

namespace scanview {
namespace {

using Clock = std::chrono::steady_clock;

double milliseconds_since(Clock::time_point start) {
  return std::chrono::duration<double, std::milli>(Clock::now() - start).count();
}

/// What a merged node counts at least, that it shows where it is alone; so little that elsewhere not even (q / q')⁴
/// times as much lifts black by a level.
constexpr double kLeastWeight = 1e-7;
/// From which weight on it hides others as any does: below, as a node that comes must not change what is seen at once.
constexpr float kWeightThatHides = 0.05F;

/// Pixels where nothing was drawn, and the rectangle that holds them.
struct Gaps {
  std::size_t count = 0;
  cv::Rect area;
};

Gaps find_gaps(cv::Mat4b const& color) {
  int left = color.cols, right = -1, top = color.rows, bottom = -1;
  std::size_t count = 0;
  for (int y = 0; y < color.rows; ++y) {
    cv::Vec4b const* const row = color[y];
    for (int x = 0; x < color.cols; ++x) {
      if (row[x][3] != 0) continue;
      ++count;
      left = std::min(left, x);
      right = std::max(right, x);
      top = std::min(top, y);
      bottom = y;
    }
  }
  if (count == 0) return {};
  return {count, cv::Rect(left, top, right - left + 1, bottom - top + 1)};
}

SoftZ::Show shown_by(WalkthroughOptions const& options) {
  return options.show == WalkthroughOptions::Show::sources ? SoftZ::Show::winner : SoftZ::Show::picture;
}

ComposedLayer composed_layer(RasterNode const& node, std::size_t index) {
  ComposedLayer layer;
  layer.texture = &node.texture();
  layer.weight = 1;
  layer.backs_hide = true;
  Eigen::Vector3f const hue = view_hue(index);
  std::copy_n(hue.data(), 3, layer.hue);
  return layer;
}

/// The parts of a picture that the rasteriser draws at once.
template <typename Do>
void for_each_block(Camera const& camera, Do const& act) {
  for (int y = 0; y < camera.height(); y += kBlock)
    for (int x = 0; x < camera.width(); x += kBlock)
      act(cv::Rect(x, y, std::min(kBlock, camera.width() - x), std::min(kBlock, camera.height() - y)));
}

void require(bool holds, char const* what) {
  if (!holds) throw Error(ErrorCode::usage, {}, std::string("walkthrough options: ") + what);
}

class LibraryInMemory final : public NodeLibrary {
 public:
  LibraryInMemory(std::vector<NodeMesh> const& nodes, double walking_radius, NodeQuality quality)
      : walking_radius_(walking_radius) {
    std::vector<double> focal;
    for (NodeMesh const& node : nodes) {
      positions_.push_back(node.position);
      nodes_.push_back(std::make_shared<RasterNode>(node, quality, walking_radius));
      for (NodeMesh::Side const& side : node.sides) focal.push_back(side.camera.fx());
    }
    if (focal.empty()) return;
    std::nth_element(focal.begin(), focal.begin() + std::ptrdiff_t(focal.size() / 2), focal.end());
    focal_length_ = focal[focal.size() / 2];
  }
  std::vector<Eigen::Vector3d> const& positions() const override { return positions_; }
  double walking_radius() const override { return walking_radius_; }
  double focal_length() const override { return focal_length_; }
  std::shared_ptr<RasterNode const> get(std::size_t node, double, Wait) override { return nodes_[node]; }
  std::vector<std::string> failures() const override { return {}; }
  bool has_failed(std::size_t) const override { return false; }
  NodeTraffic traffic() const override {
    NodeTraffic traffic;
    traffic.nodes = nodes_.size();
    for (auto const& node : nodes_) traffic.bytes += node->bytes();
    return traffic;
  }
  void follow(Eigen::Vector3d const&) override {}

 private:
  double walking_radius_, focal_length_ = 1;
  std::vector<Eigen::Vector3d> positions_;
  std::vector<std::shared_ptr<RasterNode const>> nodes_;
};

}  // namespace

std::string to_string(MergePolicy policy) {
  static char const* const names[] = {"layering", "binary", "weighted", "positional"};
  return names[static_cast<std::size_t>(policy)];
}

void WalkthroughOptions::validate() const {
  require(merged >= 1 && merged <= 16, "merged must be between 1 and 16");
  require(filling >= 0, "filling must not be negative");
  require(std::isfinite(depth_tolerance) && depth_tolerance >= 0, "depth_tolerance must not be negative");
  require(std::isfinite(parallax_tolerance_px) && parallax_tolerance_px >= 0,
          "parallax_tolerance_px must not be negative");
}

std::shared_ptr<NodeLibrary> make_node_library(std::vector<NodeMesh> const& nodes, double walking_radius,
                                               NodeQuality quality) {
  return std::make_shared<LibraryInMemory>(nodes, walking_radius, quality);
}

WalkthroughRenderer::WalkthroughRenderer(std::shared_ptr<NodeLibrary> library, WalkthroughOptions const& options,
                                         int threads)
    : library_(std::move(library)), rasterizer_(threads) {
  if (library_->positions().empty()) throw Error(ErrorCode::bad_input, {}, "a walkthrough without nodes");
  excluded_.assign(library_->positions().size(), 0);
  set_options(options);
}

void WalkthroughRenderer::set_options(WalkthroughOptions const& options) {
  options.validate();
  options_ = options;
}

void WalkthroughRenderer::exclude(std::vector<std::size_t> nodes) {
  excluded_.assign(excluded_.size(), 0);
  for (std::size_t const node : nodes) excluded_.at(node) = 1;
}

std::vector<UsedNode> WalkthroughRenderer::nodes_by_distance(Eigen::Vector3d const& eye) const {
  std::vector<UsedNode> nodes;
  auto const& positions = library_->positions();
  for (std::size_t i = 0; i < positions.size(); ++i)
    if (!excluded_[i]) nodes.push_back({i, (positions[i] - eye).norm(), 0, 0, 0});
  std::sort(nodes.begin(), nodes.end(), [](UsedNode const& a, UsedNode const& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.node < b.node;
  });
  return nodes;
}

std::shared_ptr<RasterNode const> WalkthroughRenderer::get(UsedNode const& used) {
  auto node = library_->get(used.node, used.distance,
                            patience_ == Patience::waits ? NodeLibrary::Wait::yes : NodeLibrary::Wait::no);
  complete_ = complete_ && (node || library_->has_failed(used.node));
  return node;
}

void WalkthroughRenderer::draw(std::vector<Drawn> const& nodes, Camera const& camera,
                               Eigen::Isometry3d const& scene_from_camera, cv::Mat4b color, cv::Mat1f depth) {
  SoftZ soft_z;
  soft_z.nearest = options_.policy == MergePolicy::layering;
  soft_z.show = shown_by(options_);
  Composition how = composition(soft_z, camera);
  how.agree = false;  // each side projects its own picture
  how.squarings = options_.quality == NodeQuality::density ? 2 : 0;
  how.winner = options_.policy == MergePolicy::binary;
  how.growth = float(options_.depth_tolerance);
  how.parallax = float(options_.parallax_tolerance_px / (library_->focal_length() * library_->walking_radius()));
  std::vector<LayerRasterizer::Layer> layers;
  std::vector<ComposedLayer> composed;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    LayerRasterizer::Layer layer = nodes[i].node->layer(camera, scene_from_camera);
    if (layer.parts.empty()) continue;
    layer.wireframe = options_.show == WalkthroughOptions::Show::triangles;
    layers.push_back(std::move(layer));
    ComposedLayer compose = composed_layer(*nodes[i].node, nodes[i].index);
    if (options_.policy == MergePolicy::positional) compose.weight = float(nodes[i].weight);
    compose.fill_rank = std::min(1.0F, compose.weight / kWeightThatHides);
    compose.feather = options_.silhouettes == WalkthroughOptions::Silhouettes::fade;
    composed.push_back(compose);
  }
  if (layers.empty()) {
    color.setTo(cv::Scalar::all(0));
    depth.setTo(kMissing);
    return;
  }
  rasterizer_.draw(layers, camera.width(), camera.height(), [&](LayerRasterizer::Tile& tile) {
    compose_tile(tile, measured_layers(tile, composed, how), how, color, depth);
  });
}

bool WalkthroughRenderer::fill(Drawn const& node, UsedNode& used, Camera const& camera,
                               Eigen::Isometry3d const& scene_from_camera, Frame& frame, RasterNode::What what) {
  Gaps const gaps = find_gaps(frame.color);
  if (gaps.count == 0) return false;
  Camera const narrowed = camera.cropped(gaps.area.x, gaps.area.y, gaps.area.width, gaps.area.height);
  LayerRasterizer::Layer layer = node.node->layer(narrowed, scene_from_camera, what);
  if (what == RasterNode::What::surfaces) used.sides = layer.parts.size();
  for (LayerRasterizer::Part const& part : layer.parts) used.triangles += part.mesh->labels.size();
  if (layer.parts.empty()) return true;
  for_each_block(narrowed, [&](cv::Rect const& block) {
    cv::Rect const area = block + gaps.area.tl();
    fill_gaps(node, narrowed.cropped(block.x, block.y, block.width, block.height), scene_from_camera, frame.color(area),
              frame.depth(area), what);
  });
  return true;
}

void WalkthroughRenderer::fill_gaps(Drawn const& node, Camera const& camera, Eigen::Isometry3d const& scene_from_camera,
                                    cv::Mat4b color, cv::Mat1f depth, RasterNode::What what) {
  LayerRasterizer::Layer layer = node.node->layer(camera, scene_from_camera, what);
  if (layer.parts.empty()) return;
  layer.wireframe = options_.show == WalkthroughOptions::Show::triangles;
  ComposedLayer const compose = composed_layer(*node.node, node.index);
  SoftZ soft_z;
  soft_z.nearest = true;
  soft_z.show = shown_by(options_);
  Composition const how = composition(soft_z, camera);
  Frame patch = new_frame(camera.width(), camera.height());
  rasterizer_.draw({layer}, camera.width(), camera.height(), [&](LayerRasterizer::Tile& tile) {
    constexpr std::size_t kMask = 2;  // measured_layers() uses the others
    float* const open = tile.scratch(kMask);
    std::fill_n(open, LayerRasterizer::kTilePixels, 0.0F);
    bool any = false;
    for (int y = tile.area.top; y < tile.area.bottom; ++y)
      for (int x = tile.area.left; x < tile.area.right; ++x) {
        bool const is_gap = color(y, x)[3] == 0;
        open[(y - tile.area.top) * kTileStride + x - tile.area.left] = is_gap ? 1.0F : 0.0F;
        any = any || is_gap;
      }
    if (!any) return;
    ComposedLayer of_tile = compose;
    of_tile.samples = tile.draw(0, open);
    of_tile.quality = tile.scratch(0);
    of_tile.fairness = tile.scratch(1);
    measure_quality(of_tile, how, tile.area);
    compose_tile(tile, {of_tile}, how, patch.color, patch.depth);
    for (int y = tile.area.top; y < tile.area.bottom; ++y)
      for (int x = tile.area.left; x < tile.area.right; ++x) {
        if (color(y, x)[3] != 0) continue;
        color(y, x) = patch.color(y, x);
        depth(y, x) = patch.depth(y, x);
      }
  });
}

Frame WalkthroughRenderer::render(Camera const& camera, Eigen::Isometry3d const& scene_from_camera) {
  auto const start = Clock::now();
  Eigen::Vector3d const eye = scene_from_camera.translation();
  library_->follow(eye);
  std::vector<UsedNode> const all = nodes_by_distance(eye);
  used_.clear();
  complete_ = true;
  std::vector<Drawn> merged;
  std::size_t next = 0;
  for (; next < all.size() && merged.size() < std::size_t(options_.merged); ++next) {
    auto node = get(all[next]);
    if (!node) continue;
    used_.push_back(all[next]);
    merged.push_back({std::move(node), used_.back().node, 0});
  }
  double const after = next < all.size() ? 1 / all[next].distance : 0;
  double const least = 1e-9 * library_->walking_radius();
  double sum = 0;
  for (UsedNode& used : used_) sum += used.weight = 1 / std::max(used.distance, least) - std::min(after, 1 / least);
  for (std::size_t i = 0; i < used_.size(); ++i) {
    used_[i].weight = sum > 0 ? used_[i].weight / sum : 1.0 / double(used_.size());
    merged[i].weight = std::max(used_[i].weight, kLeastWeight);
    LayerRasterizer::Layer const layer = merged[i].node->layer(camera, scene_from_camera);
    used_[i].sides = layer.parts.size();
    for (LayerRasterizer::Part const& part : layer.parts) used_[i].triangles += part.mesh->labels.size();
  }

  if (last_.color.u == nullptr || last_.color.u->refcount != 1 || last_.depth.u->refcount != 1 ||
      last_.color.size() != cv::Size(camera.width(), camera.height()))
    last_ = new_frame(camera.width(), camera.height());
  Frame frame = last_;
  for_each_block(camera, [&](cv::Rect const& block) {
    draw(merged, camera.cropped(block.x, block.y, block.width, block.height), scene_from_camera, frame.color(block),
         frame.depth(block));
  });
  stages_ = {{"merge", milliseconds_since(start)}};

  auto const filling = Clock::now();
  bool open = true;
  for (std::size_t filled = 0; open && next < all.size() && filled < std::size_t(options_.filling); ++next) {
    UsedNode used = all[next];
    auto node = get(used);
    if (!node) continue;
    merged.push_back({std::move(node), used.node, 0});
    open = fill(merged.back(), used, camera, scene_from_camera, frame, RasterNode::What::surfaces);
    if (open) used_.push_back(used);
    ++filled;
  }
  for (std::size_t i = 0; open && i < used_.size(); ++i)
    open = fill(merged[i], used_[i], camera, scene_from_camera, frame, RasterNode::What::panes);
  uncovered_ = find_gaps(frame.color).count;
  if (uncovered_ > 0 && options_.gaps == VisibilityGaps::interpolated) interpolate_gaps(frame);
  stages_["gaps"] = milliseconds_since(filling);
  return frame;
}

}  // namespace scanview
