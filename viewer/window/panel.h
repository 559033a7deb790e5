#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/window/commands.h"
#include "viewer/window/glfw_window.h"
#include "viewer/window/look.h"
#include "viewer/window/outline_marks.h"
#include "viewer/window/overlay.h"
#include "viewer/window/sphere_inset.h"

namespace scanview {

/// What the panel shows, and the choices that a person changes in it.
struct PanelContent {
  std::string set_name, unit;
  double frame_milliseconds = 0, panel_milliseconds = 0;  ///< of the last of each
  bool half_resolution = false;
  std::map<std::string, double> stages;  ///< milliseconds
  bool reading = false;                  ///< pictures are still being read
  std::vector<std::string> failures;     ///< a line a view
  std::string message;                   ///< what happened last; over the picture's lower edge
  SphereInset sphere;
  std::vector<std::string> view_names;
  /// The chosen views as each alone would be seen.
  struct StripPicture {
    std::string caption;
    Eigen::Vector3f color;  ///< the view's false colour, as shown
    unsigned texture = 0;   ///< OpenGL's name
    int width = 0, height = 0;
  };
  std::vector<StripPicture> strip;
  std::vector<std::string> mode_text;
  std::size_t keyframes = 0;
  std::string keyframe_command;  ///< that renders them; empty before the first
  double greatest_threshold = 1;
  std::vector<BackEnd> back_ends;

  WindowMode mode = WindowMode::look;
  bool turning = false;
  Look look;
  BackEnd back_end = BackEnd::gl;
  OutlineKind outline = OutlineKind::remove;
  int frames_between = 24;
};

/// What was pressed in the panel, beside the choices.
struct PanelAnswer {
  std::vector<Command> commands;
  std::optional<std::size_t> jump;  ///< a view
  bool default_look = false;
};

/// The panel beside the picture, the strip below it and the marks over it (Dear ImGui). Needs the window's context to
/// be current whenever it is made, used or destroyed; the window must outlive it.
class Panel {
 public:
  explicit Panel(GlfwWindow& window);
  ~Panel();
  Panel(Panel const&) = delete;
  Panel& operator=(Panel const&) = delete;

  bool visible = true;
  /// The part of a framebuffer of that size that is left for the picture; a flat picture has no strip below it.
  Viewport viewport(int width, int height, WindowMode mode) const;
  /// Draws into the default framebuffer, around and over `viewport`.
  PanelAnswer draw(PanelContent& content, Overlay const& overlay, Viewport const& viewport);
  /// A person is typing a number: keys are no commands.
  bool takes_keys() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace scanview
