#pragma once
#include <optional>
#include <string>
#include <vector>

#include "viewer/window/commands.h"
#include "viewer/window/panel_frame.h"
#include "viewer/window/tree_eye.h"
#include "viewer/window/viewed_tree.h"

namespace scanview {

/// What the panel of an LDI tree shows, and the choices that a person changes in it.
struct TreePanelContent : PanelStatus {
  Unit unit = Unit::m;
  std::vector<std::string> view_names;
  std::size_t cells = 0, bytes = 0;  ///< of the tree
  CellMap map;
  TreeFigures figures;
  struct LevelLine {
    Eigen::Vector3f color;  ///< level_color()
    std::string text;
  };
  std::vector<LevelLine> levels;
  enum class Progress { refining, complete, damaged } progress = Progress::refining;
  TreeEye::Mode mode = TreeEye::Mode::orbit;
  std::vector<std::string> failures;
  std::size_t keyframes = 0;
  std::string keyframe_command;  ///< that renders them; empty before the first

  TreeLook look;
  int frames_between = 24;
};

/// "0.0625 m: 12 drawn, 3 above": a level's grid step, and its cells in the picture.
std::string level_text(LevelCount const& count, Unit unit);
/// Lines about the picture that is shown: whether it is complete, what it is made of, the tree's size.
std::vector<std::string> tree_frame_text(TreePanelContent const& content);

struct TreePanelAnswer {
  std::vector<Command> commands;
  std::optional<std::size_t> jump;  ///< to a reference view
};

/// Draws it; what was pressed beside the choices.
TreePanelAnswer draw_tree_panel(PanelFrame& frame, TreePanelContent& content, Overlay const& overlay,
                                Viewport const& viewport);

}  // namespace scanview
