#include "viewer/view_based/view_based_renderer.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/error.h"
#include "viewer/blend/soft_z.h"

namespace scanview {

void ViewBasedOptions::validate() const {
  if (std::isnan(threshold)) throw Error(ErrorCode::usage, {}, "threshold is not a number");
  if (!(reliability_ratio >= 0 && reliability_ratio <= 1)) {
    throw Error(ErrorCode::usage, {}, "reliability_ratio must be between 0 and 1");
  }
  if (fill_views < 0 || fill_views > 16) throw Error(ErrorCode::usage, {}, "fill_views must be between 0 and 16");
}

double default_threshold(ViewLibrary const& library) {
  double const budget = library.set().error_budget.threshold();
  return budget > 0 ? 2 * budget : 0.01 * library.radius();
}

Eigen::Vector3f view_hue(std::size_t view) {
  // Turns by the golden angle, so that neighbours and their neighbours differ.
  constexpr double kGolden = 0.61803398874989;
  double const hue = 6 * std::fmod(0.08 + kGolden * static_cast<double>(view), 1.0);
  Eigen::Vector3f color;
  for (int c = 0; c < 3; ++c) {
    double const k = std::fmod(hue + 6 - 2 * c, 6.0);
    color[c] = static_cast<float>(0.1 + 0.9 * std::clamp(std::abs(k - 3) - 1, 0.0, 1.0));
  }
  return color;
}

ViewBasedRenderer::ViewBasedRenderer(std::shared_ptr<ViewLibrary> library, ViewBasedOptions const& options)
    : library_(std::move(library)) {
  ScanSet const& set = library_->set();
  for (auto const& view : set.views) {
    directions_.push_back(direction_to_eye(view.image.camera, *view.object_from_camera, set.center));
  }
  set_options(options);
}

void ViewBasedRenderer::set_options(ViewBasedOptions const& options) {
  options.validate();
  auto used = options;
  if (used.threshold < 0) used.threshold = default_threshold(*library_);
  exclude(used.excluded);
  options_ = std::move(used);
}

void ViewBasedRenderer::exclude(std::vector<std::size_t> const& excluded) {
  std::vector<std::size_t> used;
  std::vector<Eigen::Vector3d> directions;
  for (std::size_t i = 0; i < directions_.size(); ++i) {
    if (library_->meshes()[i].mesh.triangles.empty() || library_->failed(i)) continue;
    if (std::find(excluded.begin(), excluded.end(), i) != excluded.end()) continue;
    used.push_back(i);
    directions.push_back(directions_[i]);
  }
  if (used.empty()) throw Error(ErrorCode::bad_input, {}, "no view with a mesh is left to render from");
  options_.excluded = excluded;
  if (sphere_ && used == used_) return;
  sphere_.emplace(directions);
  spacing_ = median_spacing(directions);
  used_ = std::move(used);
  used_directions_ = std::move(directions);
}

std::vector<Eigen::Vector3i> ViewBasedRenderer::sphere_triangles() const {
  auto triangles = sphere_->triangles();
  for (auto& triangle : triangles) {
    for (int k = 0; k < 3; ++k) triangle[k] = static_cast<int>(used_[static_cast<std::size_t>(triangle[k])]);
  }
  return triangles;
}

std::vector<UsedView> ViewBasedRenderer::view_weights(Camera const& camera,
                                                      Eigen::Isometry3d const& object_from_camera) const {
  Eigen::Vector3d const eye = direction_to_eye(camera, object_from_camera, library_->set().center);
  auto views = add_fill_views(sphere_->weights(eye, last_face_), used_directions_, eye, options_.fill_views);
  // Only where very many views share one direction.
  if (views.size() > static_cast<std::size_t>(SoftZ::kMaxLayers)) {
    std::stable_sort(views.begin(), views.end(), [](UsedView const& a, UsedView const& b) {
      return a.weight != b.weight ? a.weight > b.weight : a.fill > b.fill;
    });
    views.resize(SoftZ::kMaxLayers);
    std::sort(views.begin(), views.end(), [](UsedView const& a, UsedView const& b) { return a.view < b.view; });
  }
  double sum = 0, count = 0;
  for (auto const& view : views) {
    sum += view.weight;
    count += view.weight > 0;
  }
  for (auto& view : views) {
    double const weight = options_.barycentric || view.weight <= 0 ? view.weight / sum : 1 / count;
    view = {used_[view.view], weight, view.fill};
  }
  return views;
}

SoftZ ViewBasedRenderer::soft_z(std::vector<UsedView> const& views) const {
  SoftZ how;
  how.threshold = options_.threshold;
  how.reliability_ratio = options_.reliability_ratio;
  how.always = SoftZ::kAlways * fill_rank(views);
  how.nearest = options_.visibility == ViewBasedOptions::Visibility::nearest;
  how.show = options_.show;
  return how;
}

Frame ViewBasedRenderer::render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  if (camera.width() <= 0 || camera.height() <= 0 || !object_from_camera.matrix().allFinite()) {
    throw Error(ErrorCode::bad_input, {}, "rendering needs a camera with pixels and a finite pose");
  }
  complete_ = true;
  for (;;) {
    auto const views = view_weights(camera, object_from_camera);
    std::vector<UsedView> drawn;
    bool failure = false;
    for (auto const& view : views) {
      if (ready(view.view, patient_)) {
        drawn.push_back(view);
      } else if (library_->failed(view.view)) {
        failure = true;
      } else {
        complete_ = false;
      }
    }
    if (!failure) return draw(drawn, camera, object_from_camera);
    exclude(options_.excluded);  // and so what failed
  }
}

Frame ViewBasedRenderer::render_alone(std::size_t view, Camera const& camera,
                                      Eigen::Isometry3d const& object_from_camera) {
  std::vector<UsedView> views;
  if (ready(view, patient_)) views.push_back({view, 1, 0});
  return draw(views, camera, object_from_camera);
}

}  // namespace scanview
