#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/window/commands.h"

namespace scanview {

struct WindowOptions {
  /// Fewer views that fill than elsewhere: a window must answer.
  ViewBasedOptions rendering = [] {
    ViewBasedOptions options;
    options.fill_views = 6;
    return options;
  }();
  int width = 1024, height = 768;
  std::string title = "scanview";
  /// Where P saves scanview-NNN.png and K scanview-path-NNN.json, the first number that is free.
  std::filesystem::path pictures = ".";
  WindowMode mode = WindowMode::look;  ///< to begin in
  /// What draws at first; by default OpenGL on a graphics card and otherwise the processor.
  std::optional<BackEnd> back_end;
  int frames = 0;  ///< more than 0: draws a full turn of so many frames as fast as it can, measures, and returns
  void validate() const;
};

/// Medians over the frames of WindowOptions::frames, in full resolution.
struct FrameTimes {
  int width = 0, height = 0;      ///< of the picture: the window without panel and strip
  double frame_milliseconds = 0;  ///< rendering and showing, without the panel
  double panel_milliseconds = 0;  ///< the panel, and what falls due of the strip below
  double frames_per_second = 0;   ///< of both, and of swapping
};

struct WindowResult {
  std::vector<std::string> failures;  ///< a line for each view that could not be shown, in the end
  std::optional<FrameTimes> times;    ///< where they were asked for
};

/// The interactive viewer: returns when the person closes it. window_help() says the mouse and the keys. `folder` is
/// the set's: its files are watched, and marks written to it (MarkingDesk); empty for a set in memory. Views that fail
/// are left out and logged as warnings, once each. Throws Error{io} where there is no display or the OpenGL context is
/// lost.
WindowResult view_window(std::shared_ptr<ViewLibrary> library, std::filesystem::path const& folder,
                         WindowOptions const& options, Context& context);

}  // namespace scanview
