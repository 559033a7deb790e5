#include "viewer/window/viewed_set.h"

#include <algorithm>
#include <utility>

#include "base/error.h"
#include "viewer/select/view_selection.h"

namespace scanview {

ViewedSet::ViewedSet(GlContext& context, std::shared_ptr<ViewLibrary> library, std::filesystem::path folder,
                     ViewBasedOptions const& options, std::optional<BackEnd> back_end, int threads)
    : folder_(std::move(folder)),
      options_(options),
      library_(std::move(library)),
      watch_(watched_files(folder_, library_->set())) {
  back_ends_[BackEnd::cpu] = [threads](auto const& l, auto const& o) { return make_cpu_renderer(l, o, threads); };
  back_ends_[BackEnd::gl] = [&context](auto const& l, auto const& o) { return make_gl_renderer(context, l, o); };
  if (!back_end) back_end = is_hardware(context) ? BackEnd::gl : BackEnd::cpu;
  renderer_ = make(*back_end, library_, options);
  default_look_ = look();
  learn_directions();
}

std::unique_ptr<ViewBasedRenderer> ViewedSet::make(BackEnd back_end, std::shared_ptr<ViewLibrary> const& library,
                                                   ViewBasedOptions const& options) const {
  auto renderer = back_ends_.at(back_end)(library, options);
  renderer->set_patient(false);
  return renderer;
}

void ViewedSet::learn_directions() {
  directions_.clear();
  for (auto const& view : set().views)
    directions_.push_back(direction_to_eye(view.image.camera, *view.object_from_camera, set().center));
}

std::vector<BackEnd> ViewedSet::back_ends() const {
  std::vector<BackEnd> result;
  for (auto const& [back_end, how] : back_ends_) result.push_back(back_end);
  return result;
}

void ViewedSet::draw_with(BackEnd back_end) { renderer_ = make(back_end, library_, renderer_->options()); }

void ViewedSet::set_look(Look const& look) { renderer_->set_options(with_look(renderer_->options(), look)); }

double ViewedSet::greatest_threshold() const {
  return std::max(0.1 * library_->radius(), 10 * default_look_.threshold);
}

ViewedSet::Reload ViewedSet::follow_files(Context& context) {
  if (!watch_.changed()) return Reload::unchanged;
  try {
    auto const library = ViewLibrary::open(folder_, context);
    Look now = look();
    bool const touched = now.threshold != default_look_.threshold || !now.soft_z;
    ViewBasedOptions options = with_look(options_, now);
    if (!touched) options.threshold = options_.threshold;
    auto renderer = make(renderer_->back_end(), library, options);
    library_ = library;
    renderer_ = std::move(renderer);
  } catch (Error const& error) {
    problem_ = error.what();
    return Reload::failed;
  }
  ViewBasedOptions fresh = options_;
  if (fresh.threshold < 0) {
    // What the renderer makes of the new error budget.
    ViewBasedOptions const kept = renderer_->options();
    renderer_->set_options(fresh);
    default_look_.threshold = look().threshold;
    renderer_->set_options(kept);
  }
  watch_ = FileWatch(watched_files(folder_, set()));
  learn_directions();
  used_.clear();
  come_ = 0;
  return Reload::done;
}

ShownFrame const& ViewedSet::render(PathCamera const& eye, int width, int height) {
  shown_.camera = fit_camera(eye.camera, width, height);
  shown_.object_from_camera = eye.object_from_camera;
  shown_.frame = renderer_->render(shown_.camera, shown_.object_from_camera);
  used_ = renderer_->view_weights(shown_.camera, shown_.object_from_camera);
  return shown_;
}

bool ViewedSet::picture_has_come() {
  if (renderer_->complete()) return false;
  std::size_t come = 0;
  for (auto const& view : used_)
    come += !library_->picture_if_ready(view.view).empty() || library_->failed(view.view) ? 1 : 0;
  return std::exchange(come_, come) != come;
}

SphereInset ViewedSet::inset() const {
  return sphere_inset(directions_, renderer_->sphere_triangles(), used_,
                      direction_to_eye(shown_.camera, shown_.object_from_camera, set().center),
                      shown_.object_from_camera.linear());
}

}  // namespace scanview
