#pragma once
#include <string>
#include <vector>

#include "viewer/window/commands.h"
#include "viewer/window/panel_frame.h"
#include "viewer/window/viewed_model.h"

namespace scanview {

/// What the panel of a model shows, and the choices that a person changes in it.
struct ModelPanelContent : PanelStatus {
  std::size_t polygons = 0, triangles = 0;  ///< of the model
  bool has_visibility = false;
  std::size_t patches = 0;    ///< of the visibility field
  double nearest_sample = 0;  ///< distance of its nearest samples, in radii; 0: it has none
  double distance = 0;        ///< of the choosing eye, in radii
  ModelFigures figures;
  bool frozen = false;  ///< the choosing eye stays where it is
  std::size_t cameras = 0;
  std::string camera_file;  ///< they are written to; empty before the first
  ModelLook look;
};

/// Draws it; the buttons that were pressed.
std::vector<Command> draw_model_panel(PanelFrame& frame, ModelPanelContent const& content, Overlay const& overlay,
                                      Viewport const& viewport);

}  // namespace scanview
