#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "viewer/window/commands.h"
#include "viewer/window/look.h"
#include "viewer/window/outline_marks.h"
#include "viewer/window/overlay.h"
#include "viewer/window/panel_frame.h"
#include "viewer/window/sphere_inset.h"

namespace scanview {

/// What the panel shows of a set of views, and the choices that a person changes in it.
struct PanelContent : PanelStatus {
  std::string unit;
  std::map<std::string, double> stages;  ///< milliseconds
  std::vector<std::string> failures;     ///< a line a view
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

/// The panel beside the picture of a set, and the strip below it, in a frame that must outlive it.
class Panel {
 public:
  explicit Panel(PanelFrame& frame) : frame_(frame) {}
  /// The part of a framebuffer of that size that is left for the picture; a flat picture has no strip below it.
  Viewport viewport(int width, int height, WindowMode mode) const;
  PanelAnswer draw(PanelContent& content, Overlay const& overlay, Viewport const& viewport);

 private:
  PanelFrame& frame_;
};

}  // namespace scanview
