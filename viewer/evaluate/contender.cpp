#include "viewer/evaluate/contender.h"

#include <algorithm>

#include "base/error.h"
#include "viewer/evaluate/fused_mesh.h"
#include "viewer/evaluate/lumigraph_renderer.h"

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
  if (auto fused = make_fused_mesh_renderer(set)) {
    all.push_back({"fused_mesh", "fused mesh, vertex colours (Open3D)", std::move(fused)});
  }
  return all;
}

}  // namespace scanview
