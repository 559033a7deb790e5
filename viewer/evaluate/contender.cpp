#include "viewer/evaluate/contender.h"

#include <algorithm>

#include "base/error.h"
#include "base/median.h"
#include "viewer/evaluate/fused_mesh.h"
#include "viewer/evaluate/lumigraph_renderer.h"
#include "viewer/layered/ldi_builder.h"
#include "viewer/layered/ldi_renderer.h"
#include "viewer/walkthrough/view_node.h"
#include "viewer/walkthrough/walkthrough_renderer.h"

namespace scanview {
namespace {

/// Our own renderer, with any options.
class ViewBased final : public HeldOutRenderer {
 public:
  explicit ViewBased(std::unique_ptr<ViewBasedRenderer> renderer) : renderer_(std::move(renderer)) {}
  void exclude(std::vector<std::size_t> const& views) override { renderer_->exclude(views); }
  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    return renderer_->render(camera, object_from_camera);
  }

 private:
  std::unique_ptr<ViewBasedRenderer> renderer_;
};

class NearestView final : public HeldOutRenderer {
 public:
  explicit NearestView(std::unique_ptr<ViewBasedRenderer> renderer) : renderer_(std::move(renderer)) {}
  void exclude(std::vector<std::size_t> const& views) override { renderer_->exclude(views); }
  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    ScanSet const& set = renderer_->library().set();
    Eigen::Vector3d const eye = direction_to_eye(camera, object_from_camera, set.center);
    auto const& excluded = renderer_->options().excluded;
    std::size_t nearest = set.views.size();
    double greatest = -2;
    for (std::size_t i = 0; i < set.views.size(); ++i) {
      if (renderer_->library().meshes()[i].mesh.triangles.empty()) continue;
      if (std::find(excluded.begin(), excluded.end(), i) != excluded.end()) continue;
      View const& view = set.views[i];
      double const cosine = direction_to_eye(view.image.camera, *view.object_from_camera, set.center).dot(eye);
      if (cosine > greatest) {
        greatest = cosine;
        nearest = i;
      }
    }
    return renderer_->render_alone(nearest, camera, object_from_camera);
  }

 private:
  std::unique_ptr<ViewBasedRenderer> renderer_;
};

/// Every view a node of one side.
class Walkthrough final : public HeldOutRenderer {
 public:
  Walkthrough(ViewLibrary& library, double threshold, int threads) {
    std::vector<NodeMesh> nodes;
    std::vector<double> depths;
    std::size_t const count = library.meshes().size();
    node_of_view_.assign(count, -1);
    for (std::size_t v = 0; v < count; ++v) {
      cv::Mat3b const picture = library.picture(v);
      if (library.meshes()[v].mesh.triangles.empty() || picture.empty()) continue;
      node_of_view_[v] = int(nodes.size());
      nodes.push_back(view_node(library.set().views[v], library.meshes()[v], picture));
      for (auto const& vertex : nodes.back().vertices) depths.push_back(double(vertex.norm()));
    }
    WalkthroughOptions options;
    constexpr int kMost = 8;  // an object is surrounded by gaps that nothing fills
    options.filling = std::min(int(count), kMost);
    // What views may differ by is a length, the same at all depths: about the median one.
    options.depth_tolerance = threshold / median(depths);
    options.parallax_tolerance_px = 0;
    renderer_ = std::make_unique<WalkthroughRenderer>(make_node_library(nodes, median(depths)), options, threads);
  }
  void exclude(std::vector<std::size_t> const& views) override {
    std::vector<std::size_t> nodes;
    for (std::size_t const view : views)
      if (node_of_view_[view] >= 0) nodes.push_back(std::size_t(node_of_view_[view]));
    renderer_->exclude(std::move(nodes));
  }
  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    return renderer_->render(camera, object_from_camera);
  }

 private:
  std::vector<int> node_of_view_;  ///< −1: none
  std::unique_ptr<WalkthroughRenderer> renderer_;
};

/// Its tree is built anew without the views that are held out: what images add cannot be taken out again.
class LayeredTree final : public HeldOutRenderer {
 public:
  LayeredTree(ScanSet const& set, double threshold, int threads) : views_(set.views), unit_(set.unit) {
    options_.depth_error = threshold;
    context_.threads = threads;
  }
  void exclude(std::vector<std::size_t> const& views) override {
    if (renderer_ && views == excluded_) return;
    std::vector<View> used;
    for (std::size_t v = 0; v < views_.size(); ++v)
      if (std::find(views.begin(), views.end(), v) == views.end()) used.push_back(views_[v]);
    renderer_.reset();  // two trees at once would need twice the memory
    LdiBuilder builder(options_);
    builder.add(used, context_);
    auto tree = std::make_shared<LdiTree const>(builder.build(unit_, context_));
    renderer_ = std::make_unique<LdiRenderer>(std::move(tree), LdiRenderOptions(), context_.threads);
    excluded_ = views;
  }
  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    if (!renderer_) exclude({});
    return renderer_->render(camera, object_from_camera);
  }

 private:
  std::vector<View> views_;
  Unit unit_;
  LdiOptions options_;
  Context context_;
  std::vector<std::size_t> excluded_;
  std::unique_ptr<LdiRenderer> renderer_;
};

bool has_orthographic_views(ScanSet const& set) {
  return std::any_of(set.views.begin(), set.views.end(),
                     [](View const& view) { return !view.image.camera.is_perspective(); });
}

}  // namespace

std::vector<Contender> make_contenders(ScanSet const& set, std::shared_ptr<ViewLibrary> library,
                                       ViewBasedOptions const& options, Context& context) {
  std::vector<Contender> all;
  all.push_back({"view_based", "view-based (ours)",
                 std::make_unique<ViewBased>(make_cpu_renderer(library, options, context.threads))});
  all.push_back({"nearest_view", "nearest view alone",
                 std::make_unique<NearestView>(make_cpu_renderer(library, options, context.threads))});
  ViewBasedOptions collage = options;
  collage.visibility = ViewBasedOptions::Visibility::nearest;
  collage.fill_views = 0;
  all.push_back({"collage", "z-buffered collage of three",
                 std::make_unique<ViewBased>(make_cpu_renderer(library, collage, context.threads))});
  LumigraphOptions lumigraph;
  lumigraph.threshold = options.threshold;
  all.push_back({"lumigraph", "unstructured lumigraph (k = 4)", make_lumigraph_renderer(library, lumigraph)});
  double const threshold = options.threshold >= 0 ? options.threshold : default_threshold(*library);
  all.push_back({"ldi", "LDI tree", std::make_unique<LayeredTree>(set, threshold, context.threads)});
  if (!has_orthographic_views(set)) {
    all.push_back({"walkthrough", "walkthrough, each view a node",
                   std::make_unique<Walkthrough>(*library, threshold, context.threads)});
  }
  if (auto fused = make_fused_mesh_renderer(set)) {
    all.push_back({"fused_mesh", "fused mesh, vertex colours (Open3D)", std::move(fused)});
  }
  return all;
}

}  // namespace scanview
