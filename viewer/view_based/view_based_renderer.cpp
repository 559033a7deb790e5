#include "viewer/view_based/view_based_renderer.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>

#include "base/error.h"
#include "viewer/blend/layer_targets.h"
#include "viewer/blend/soft_z_compositor.h"
#include "viewer/select/view_selection.h"
#include "viewer/view_based/view_pass.h"

namespace scanview {
namespace {

/// What is drawn with the context; made and destroyed while it is current.
struct GpuPart {
  explicit GpuPart(GlFunctions const& gl) : targets(gl), compositor(gl), pass(gl) {}
  LayerTargets targets;
  SoftZCompositor compositor;
  ViewPass pass;
  std::vector<GpuView> views;
};

class OpenGlRenderer final : public ViewBasedRenderer {
 public:
  OpenGlRenderer(GlContext& context, ScanSet const& set, std::vector<ViewMesh> const& meshes,
                 ViewBasedOptions const& options)
      : context_(context), center_(set.center), options_(options) {
    options.validate();
    if (!set.has_poses()) throw Error(ErrorCode::bad_input, {}, "the set has views without a pose: register it first");
    if (meshes.size() != set.views.size()) {
      throw Error(ErrorCode::bad_input, {}, "the set does not have one mesh a view: mesh it first");
    }
    if (options_.threshold < 0) options_.threshold = set.error_budget.threshold();
    if (!(options_.threshold > 0) && options.threshold < 0) options_.threshold = 0.01 * set.radius();
    for (auto const& view : set.views) {
      directions_.push_back(direction_to_eye(view.image.camera, *view.object_from_camera, center_));
    }
    context_.make_current();
    gl_ = load_gl_functions(context_);
    gpu_.emplace(gl_);
    for (std::size_t i = 0; i < meshes.size(); ++i) gpu_->views.emplace_back(gl_, set.views[i], meshes[i]);
    exclude(options.excluded);
  }
  ~OpenGlRenderer() override {
    // Where the context cannot be bound any more its objects are gone with it.
    try {
      context_.make_current();
    } catch (Error const&) {
    }
    gpu_.reset();
  }

  void exclude(std::vector<std::size_t> const& excluded) override {
    std::vector<std::size_t> used;
    std::vector<Eigen::Vector3d> directions;
    for (std::size_t i = 0; i < gpu_->views.size(); ++i) {
      if (gpu_->views[i].empty() || std::find(excluded.begin(), excluded.end(), i) != excluded.end()) continue;
      used.push_back(i);
      directions.push_back(directions_[i]);
    }
    if (used.empty()) throw Error(ErrorCode::bad_input, {}, "no view with a mesh is left to render from");
    sphere_.emplace(directions);
    used_ = std::move(used);
    used_directions_ = std::move(directions);
  }

  std::vector<UsedView> view_weights(Camera const& camera, Eigen::Isometry3d const& object_from_camera) const override {
    Eigen::Vector3d const eye = direction_to_eye(camera, object_from_camera, center_);
    auto views = add_fill_views(sphere_->weights(eye), used_directions_, eye, options_.fill_views);
    // Only where very many views share one direction.
    if (views.size() > static_cast<std::size_t>(SoftZCompositor::kMaxLayers)) {
      std::stable_sort(views.begin(), views.end(), [](UsedView const& a, UsedView const& b) {
        return a.weight != b.weight ? a.weight > b.weight : a.fill > b.fill;
      });
      views.resize(SoftZCompositor::kMaxLayers);
      std::sort(views.begin(), views.end(), [](UsedView const& a, UsedView const& b) { return a.view < b.view; });
    }
    double sum = 0;
    for (auto const& view : views) sum += view.weight;
    for (auto& view : views) view = {used_[view.view], view.weight / sum, view.fill};
    return views;
  }

  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override {
    if (camera.width() <= 0 || camera.height() <= 0 || !object_from_camera.matrix().allFinite()) {
      throw Error(ErrorCode::bad_input, {}, "rendering needs a camera with pixels and a finite pose");
    }
    context_.make_current();
    std::vector<UsedView> drawn;
    for (auto const& view : view_weights(camera, object_from_camera)) {
      if (ViewPass::in_front(gpu_->views[view.view], camera, object_from_camera)) drawn.push_back(view);
    }
    gpu_->targets.resize(camera.width(), camera.height(), std::max<int>(1, static_cast<int>(drawn.size())));
    std::vector<LayerWeight> weights;
    for (auto const& view : drawn) {
      gpu_->targets.begin_layer(static_cast<int>(weights.size()));
      gpu_->pass.draw(gpu_->views[view.view], camera, object_from_camera);
      weights.push_back({view.weight, view.fill});
    }
    return gpu_->compositor.compose(gpu_->targets, weights, options_.threshold, options_.reliability_ratio);
  }

 private:
  GlContext& context_;
  Eigen::Vector3d center_;
  ViewBasedOptions options_;
  std::vector<Eigen::Vector3d> directions_, used_directions_;  ///< of all views; of those that are used
  std::vector<std::size_t> used_;
  std::optional<ViewSphere> sphere_;
  GlFunctions gl_;
  std::optional<GpuPart> gpu_;
};

}  // namespace

void ViewBasedOptions::validate() const {
  if (std::isnan(threshold)) throw Error(ErrorCode::usage, {}, "threshold is not a number");
  if (!(reliability_ratio >= 0 && reliability_ratio <= 1)) {
    throw Error(ErrorCode::usage, {}, "reliability_ratio must be between 0 and 1");
  }
  if (fill_views < 0 || fill_views > 16) throw Error(ErrorCode::usage, {}, "fill_views must be between 0 and 16");
}

std::unique_ptr<ViewBasedRenderer> make_view_based_renderer(GlContext& context, ScanSet const& set,
                                                            std::vector<ViewMesh> const& meshes,
                                                            ViewBasedOptions const& options) {
  return std::make_unique<OpenGlRenderer>(context, set, meshes, options);
}

}  // namespace scanview
