#pragma once
#include <functional>
#include <memory>
#include <string>

#include "viewer/window/glfw_window.h"
#include "viewer/window/overlay.h"

namespace scanview {

/// What every window's panel shows, whatever is looked at.
struct PanelStatus {
  std::string set_name;
  double frame_milliseconds = 0, panel_milliseconds = 0;  ///< of the last of each
  bool half_resolution = false;
  bool reading = false;  ///< pictures are still being read
  std::string message;   ///< what happened last; over the picture's lower edge
  bool turning = false;  ///< the turntable
};

/// The place of panels around a picture, and the marks over it (Dear ImGui). Needs the window's context to be current
/// whenever it is made, used or destroyed; the window must outlive it.
class PanelFrame {
 public:
  explicit PanelFrame(GlfwWindow& window);
  ~PanelFrame();
  PanelFrame(PanelFrame const&) = delete;
  PanelFrame& operator=(PanelFrame const&) = delete;

  bool visible = true;
  /// The part of a framebuffer of that size that is left for the picture, above a strip of that height (in units of the
  /// screen at the usual size of letters).
  Viewport viewport(int width, int height, float strip_height = 0) const;
  /// Draws into the default framebuffer, around and over `viewport`. panel, strip: what is in them, in Dear ImGui's
  /// calls; the names, the times and the message are there already.
  void draw(PanelStatus const& status, Overlay const& overlay, Viewport const& viewport,
            std::function<void()> const& panel, std::function<void()> const& strip = {});
  /// A person is typing a number: keys are no commands.
  bool takes_keys() const;
  float scale() const { return scale_; }  ///< of letters, to the usual size

 private:
  GlfwWindow& window_;
  float scale_ = 1;
};

}  // namespace scanview
