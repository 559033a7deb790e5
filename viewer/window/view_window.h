#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "mesh/view_mesh.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {

struct WindowOptions {
  ViewBasedOptions rendering;
  int width = 1024, height = 768;
  std::string title = "scanview";
  std::filesystem::path pictures = ".";  ///< where P saves scanview-NNN.png, the first number that is free
  void validate() const;
};

/// The mouse and the keys, one a line.
std::string window_help();

/// The interactive viewer: returns when the person closes it. Left drag turns, right or shift drag pans, wheel zooms;
/// window_help() says the keys. Throws Error{io} where there is no display.
void view_window(ScanSet const& set, std::vector<ViewMesh> const& meshes, WindowOptions const& options,
                 Context& context);

}  // namespace scanview
