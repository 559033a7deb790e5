#pragma once
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/window/commands.h"
#include "viewer/window/window_options.h"

namespace scanview {

struct WindowOptions : BasicWindowOptions {
  /// Fewer views that fill than elsewhere: a window must answer.
  ViewBasedOptions rendering = [] {
    ViewBasedOptions options;
    options.fill_views = 6;
    return options;
  }();
  WindowMode mode = WindowMode::look;  ///< to begin in
  /// What draws at first; by default OpenGL on a graphics card and otherwise the processor.
  std::optional<BackEnd> back_end;
  void validate() const;
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
