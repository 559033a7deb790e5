#pragma once
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "viewer/window/commands.h"
#include "viewer/window/node_map.h"
#include "viewer/window/panel_frame.h"
#include "viewer/window/walk_look.h"

namespace scanview {

/// What the panel of a walkthrough shows, and the choices that a person changes in it.
struct WalkPanelContent : PanelStatus {
  Unit unit = Unit::m;
  std::vector<std::string> names;  ///< of the nodes
  NodeMap map;
  std::vector<UsedNode> used;
  double uncovered = 0;                  ///< share of the picture's pixels
  std::map<std::string, double> stages;  ///< milliseconds
  NodeTraffic traffic;
  std::vector<std::string> failures;  ///< NodeLibrary
  bool has_box = false, is_free = false;
  std::size_t keyframes = 0;
  std::string keyframe_command;  ///< that renders them; empty before the first

  WalkLook look;
  int frames_between = 24;
};

/// "003  62 %  0.842 m  12345 tri.": a node that was drawn, its share, its distance, and its triangles.
std::string used_node_text(WalkPanelContent const& content, UsedNode const& used);
/// Lines about the frame that is shown: what is uncovered, the stages' times, the nodes in memory.
std::vector<std::string> walk_frame_text(WalkPanelContent const& content);

struct WalkPanelAnswer {
  std::vector<Command> commands;
  std::optional<std::size_t> jump;  ///< to a node
};

/// Draws it; what was pressed beside the choices.
WalkPanelAnswer draw_walk_panel(PanelFrame& frame, WalkPanelContent& content, Overlay const& overlay,
                                Viewport const& viewport);

}  // namespace scanview
