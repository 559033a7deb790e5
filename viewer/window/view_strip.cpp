#include "viewer/window/view_strip.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "viewer/window/frame_presenter.h"

namespace scanview {

std::vector<PanelContent::StripPicture> ViewStrip::render(ViewBasedRenderer& renderer,
                                                          std::vector<UsedView> const& used, PathCamera const& eye,
                                                          Viewport const& viewport) {
  constexpr double kLeast = 0.005;  // less would read 0.00
  constexpr std::size_t kMost = 4;
  constexpr int kHeight = 120, kWidest = 240;
  std::vector<UsedView> views;
  for (auto const& view : used) {
    if (view.weight > kLeast) views.push_back(view);
  }
  std::stable_sort(views.begin(), views.end(),
                   [](UsedView const& a, UsedView const& b) { return a.weight > b.weight; });
  if (views.size() > kMost) views.resize(kMost);
  int const width =
      std::clamp(kHeight * viewport.width / std::max(1, viewport.height), kHeight / 2, static_cast<int>(kWidest));
  Camera const camera = fit_camera(eye.camera, width, kHeight);

  ViewBasedOptions const options = renderer.options();
  ViewBasedOptions plain = options;
  plain.show = SoftZ::Show::picture;
  renderer.set_options(plain);
  std::vector<PanelContent::StripPicture> strip;
  for (auto const& view : views) {
    Frame const frame = renderer.render_alone(view.view, camera, eye.object_from_camera);
    compose_background(frame.color, composed_);
    if (textures_.size() == strip.size()) textures_.emplace_back(gl_);
    gl_.BindTexture(GL_TEXTURE_2D, textures_[strip.size()].name());
    gl_.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    gl_.PixelStorei(GL_UNPACK_ALIGNMENT, 4);
    gl_.TexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, composed_.cols, composed_.rows, 0, GL_BGRA, GL_UNSIGNED_INT_8_8_8_8_REV,
                   composed_.data);
    strip.push_back({fmt::format("{}: {:.2f}", renderer.library().set().views[view.view].name, view.weight),
                     view_hue(view.view), textures_[strip.size()].name(), composed_.cols, composed_.rows});
  }
  renderer.set_options(options);
  return strip;
}

}  // namespace scanview
