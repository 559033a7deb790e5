#pragma once
#include <vector>

#include "viewer/gl/gl_objects.h"
#include "viewer/select/camera_path.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/window/panel.h"

namespace scanview {

/// The views that are mixed, each alone from the same eye (Pulli 1997, the figure of three views and their blend), as
/// small textures. The context must be current when it is made and destroyed.
class ViewStrip {
 public:
  explicit ViewStrip(GlFunctions const& gl) : gl_(gl) {}
  /// Heaviest first, four at most; of the shape of `viewport`. Leaves the renderer's options as they were, and its
  /// context current.
  std::vector<PanelContent::StripPicture> render(ViewBasedRenderer& renderer, std::vector<UsedView> const& used,
                                                 PathCamera const& eye, Viewport const& viewport);

 private:
  GlFunctions const& gl_;
  std::vector<GlTexture> textures_;
  cv::Mat4b composed_;
};

}  // namespace scanview
