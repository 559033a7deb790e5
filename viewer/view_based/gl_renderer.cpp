#include <chrono>
#include <optional>
#include <string>

#include "base/error.h"
#include "viewer/blend/layer_targets.h"
#include "viewer/blend/soft_z_compositor.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/view_based/view_pass.h"

namespace scanview {
namespace {

/// What is drawn with the context; made and destroyed while it is current.
struct GpuPart {
  explicit GpuPart(GlFunctions const& gl) : targets(gl), compositor(gl), pass(gl) {}
  LayerTargets targets;
  SoftZCompositor compositor;
  ViewPass pass;
  std::vector<std::optional<GpuView>> views;
};

class GlRenderer final : public ViewBasedRenderer {
 public:
  GlRenderer(GlContext& context, std::shared_ptr<ViewLibrary> library, ViewBasedOptions const& options)
      : ViewBasedRenderer(std::move(library), options), context_(context) {
    context_.make_current();
    gl_ = load_gl_functions(context_);
    gpu_.emplace(gl_);
    gpu_->views.resize(this->library().meshes().size());
  }
  ~GlRenderer() override {
    // Where the context cannot be bound any more its objects are gone with it.
    try {
      context_.make_current();
    } catch (Error const&) {
    }
    gpu_.reset();
  }
  BackEnd back_end() const override { return BackEnd::gl; }

 private:
  bool ready(std::size_t view, bool wait) override {
    if (gpu_->views[view]) return true;
    cv::Mat3b const picture = wait ? library().picture(view) : library().picture_if_ready(view);
    if (picture.empty()) return false;
    ViewMesh const& mesh = library().meshes()[view];
    context_.make_current();
    gpu_->views[view].emplace(gl_, library().set().views[view], mesh, picture_pyramid(picture, mesh),
                              library().set().light);
    return true;
  }

  Frame draw(std::vector<UsedView> const& views, Camera const& camera,
             Eigen::Isometry3d const& object_from_camera) override {
    auto const start = std::chrono::steady_clock::now();
    context_.make_current();
    std::vector<UsedView> drawn;
    for (auto const& view : views) {
      if (ViewPass::in_front(*gpu_->views[view.view], camera, object_from_camera)) drawn.push_back(view);
    }
    gpu_->targets.resize(camera.width(), camera.height(), std::max<int>(1, static_cast<int>(drawn.size())));
    std::vector<LayerWeight> weights;
    std::vector<LayerPicture> pictures;
    double const rank = fill_rank(views);
    for (auto const& view : drawn) {
      GpuView const& gpu = *gpu_->views[view.view];
      gpu_->targets.begin_layer(static_cast<int>(weights.size()));
      gpu_->pass.draw(gpu, camera, object_from_camera,
                      {options().cosine, options().feather, options().wireframe, options().relight, spacing()});
      weights.push_back({view.weight, view.fill, rank * view.fill, view_hue(view.view)});
      gpu.place(camera, object_from_camera, pictures.emplace_back());
    }
    // OpenGL works asynchronously: only the whole can be timed.
    Frame frame = gpu_->compositor.compose(gpu_->targets, weights, pictures, soft_z(views));
    std::chrono::duration<double, std::milli> const took = std::chrono::steady_clock::now() - start;
    stages_ = {{"frame", took.count()}};
    return frame;
  }

  GlContext& context_;
  GlFunctions gl_;
  std::optional<GpuPart> gpu_;
};

}  // namespace

std::unique_ptr<ViewBasedRenderer> make_gl_renderer(GlContext& context, std::shared_ptr<ViewLibrary> library,
                                                    ViewBasedOptions const& options) {
  return std::make_unique<GlRenderer>(context, std::move(library), options);
}

bool is_hardware(GlContext& context) {
  context.make_current();
  auto const gl = load_gl_functions(context);
  auto const* const text = reinterpret_cast<char const*>(gl.GetString(GL_RENDERER));
  std::string const name = text == nullptr ? "" : text;
  for (char const* const software : {"llvmpipe", "softpipe", "swrast", "Software Rasterizer", "SwiftShader"}) {
    if (name.find(software) != std::string::npos) return false;
  }
  return true;
}

}  // namespace scanview
