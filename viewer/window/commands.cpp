#include "viewer/window/commands.h"

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

namespace scanview {
namespace {

/// What a key means whatever is looked at.
std::optional<Command> common_command_of_key(int key) {
  switch (key) {
    case GLFW_KEY_H:
      return Command::help;
    case GLFW_KEY_TAB:
      return Command::toggle_panel;
    case GLFW_KEY_R:
      return Command::reset;
    case GLFW_KEY_P:
      return Command::save_picture;
    default:
      return std::nullopt;
  }
}

}  // namespace

std::optional<Command> command_of_key(int key, WindowMode mode) {
  auto const into = [&](WindowMode wanted, Command command) { return mode == wanted ? Command::look : command; };
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return mode == WindowMode::look ? Command::quit : Command::look;
    case GLFW_KEY_M:
      return into(WindowMode::measure, Command::measure);
    case GLFW_KEY_N:
      return into(WindowMode::mark, Command::mark);
    case GLFW_KEY_O:
      return into(WindowMode::outline, Command::outline);
    default:
      break;
  }
  if (auto const common = common_command_of_key(key)) return common;
  if (shows_picture(mode)) {
    switch (key) {
      case GLFW_KEY_LEFT:
      case GLFW_KEY_PAGE_UP:
        return Command::previous_view;
      case GLFW_KEY_RIGHT:
      case GLFW_KEY_PAGE_DOWN:
        return Command::next_view;
      case GLFW_KEY_BACKSPACE:
        return Command::remove_last;
      default:
        break;
    }
    if (mode == WindowMode::mark && key == GLFW_KEY_UP) return Command::next_point;
    if (mode == WindowMode::mark && key == GLFW_KEY_DOWN) return Command::previous_point;
    if (mode == WindowMode::outline && (key == GLFW_KEY_ENTER || key == GLFW_KEY_KP_ENTER))
      return Command::close_outline;
    return std::nullopt;
  }
  if (key == GLFW_KEY_SPACE) return Command::turntable;
  if (key == GLFW_KEY_K) return Command::add_keyframe;
  if (mode == WindowMode::measure && key == GLFW_KEY_BACKSPACE) return Command::remove_last;
  return std::nullopt;
}

std::optional<Command> model_command_of_key(int key) {
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return Command::quit;
    case GLFW_KEY_SPACE:
      return Command::turntable;
    case GLFW_KEY_F:
      return Command::freeze_eye;
    case GLFW_KEY_V:
      return Command::toggle_visibility;
    case GLFW_KEY_T:
      return Command::toggle_facing;
    case GLFW_KEY_G:
      return Command::toggle_culled;
    case GLFW_KEY_N:
      return Command::toggle_lines;
    case GLFW_KEY_C:
      return Command::add_camera;
    case GLFW_KEY_U:
      return Command::next_up;
    default:
      return common_command_of_key(key);
  }
}

std::optional<Command> walk_command_of_key(int key) {
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return Command::quit;
    case GLFW_KEY_SPACE:
      return Command::turntable;
    case GLFW_KEY_HOME:
      return Command::reset;
    case GLFW_KEY_K:
      return Command::add_keyframe;
    case GLFW_KEY_M:
      return Command::next_policy;
    case GLFW_KEY_G:
      return Command::next_gaps;
    case GLFW_KEY_F:
      return Command::toggle_filling;
    case GLFW_KEY_V:
      return Command::toggle_sources;
    case GLFW_KEY_T:
      return Command::toggle_triangles;
    case GLFW_KEY_L:
      return Command::toggle_free;
    case GLFW_KEY_N:
      return Command::next_node;
    case GLFW_KEY_B:
      return Command::previous_node;
    default:
      return common_command_of_key(key);
  }
}

std::optional<Command> tree_command_of_key(int key) {
  switch (key) {
    case GLFW_KEY_ESCAPE:
      return Command::quit;
    case GLFW_KEY_SPACE:
      return Command::turntable;
    case GLFW_KEY_HOME:
      return Command::reset;
    case GLFW_KEY_K:
      return Command::add_keyframe;
    case GLFW_KEY_O:
      return Command::toggle_walking;
    case GLFW_KEY_C:
      return Command::next_cells;
    case GLFW_KEY_V:
      return Command::toggle_levels;
    case GLFW_KEY_G:
      return Command::next_gaps;
    case GLFW_KEY_T:
      return Command::next_detail;
    case GLFW_KEY_N:
      return Command::next_view;
    case GLFW_KEY_B:
      return Command::previous_view;
    default:
      return common_command_of_key(key);
  }
}

std::optional<WalkStep> walk_step_of_key(int key) {
  constexpr double kTurnDeg = 75;
  switch (key) {
    case GLFW_KEY_W:
    case GLFW_KEY_UP:
      return WalkStep{1, 0, 0, 0};
    case GLFW_KEY_S:
    case GLFW_KEY_DOWN:
      return WalkStep{-1, 0, 0, 0};
    case GLFW_KEY_D:
      return WalkStep{0, 1, 0, 0};
    case GLFW_KEY_A:
      return WalkStep{0, -1, 0, 0};
    case GLFW_KEY_E:
    case GLFW_KEY_PAGE_UP:
      return WalkStep{0, 0, 1, 0};
    case GLFW_KEY_Q:
    case GLFW_KEY_PAGE_DOWN:
      return WalkStep{0, 0, -1, 0};
    case GLFW_KEY_RIGHT:
      return WalkStep{0, 0, 0, kTurnDeg};
    case GLFW_KEY_LEFT:
      return WalkStep{0, 0, 0, -kTurnDeg};
    default:
      return std::nullopt;
  }
}

std::optional<std::size_t> view_of_key(int key) {
  if (key < GLFW_KEY_1 || key > GLFW_KEY_9) return std::nullopt;
  return static_cast<std::size_t>(key - GLFW_KEY_1);
}

std::string window_help() {
  return "left drag: turn\n"
         "right, middle or shift drag: pan\n"
         "wheel: nearer, further\n"
         "double click: the pivot that turning is about\n"
         "1-9: from the place of a view\n"
         "space: turntable\n"
         "R: back to the start\n"
         "P: save a picture\n"
         "K: add a keyframe for render --path\n"
         "M: measure between two clicked points\n"
         "N: mark points for register --init\n"
         "O: draw outlines for mesh --marks\n"
         "Tab: panel on and off\n"
         "H: this help\n"
         "Esc: leave a mode; quit\n"
         "In N and O: left and right change the view, up and down the point, Enter closes an outline, "
         "Backspace removes the last";
}

std::string model_window_help() {
  return "left drag: turn\n"
         "right, middle or shift drag: pan\n"
         "wheel: nearer, further\n"
         "double click: the pivot that turning is about\n"
         "space: turntable\n"
         "R: back to the start\n"
         "P: save a picture\n"
         "V: only what the visibility file says can be seen, or everything\n"
         "T: leave out what turns its back, too\n"
         "F: freeze the eye that this is chosen for, or let it follow\n"
         "G: show faintly what is left out\n"
         "N: silhouettes and creases on white paper\n"
         "U: another of the model's axes is up\n"
         "C: add a camera for visibility build --cameras\n"
         "Tab: panel on and off\n"
         "H: this help\n"
         "Esc: quit";
}

std::string tree_window_help() {
  return "O: go around the object, or walk in the scene\n"
         "going around it: left drag: turn; right, middle or shift drag: pan; wheel: nearer, further; double click: "
         "the "
         "pivot that turning is about\n"
         "walking: W, S or up, down: forwards, backwards; A, D: sideways; left, right: turn; E, Q or page up, page "
         "down: raise, lower the eye; shift: three times as fast; drag: look around; wheel: forwards, backwards\n"
         "1-9, N, B: to a reference view, the next, the one before; or click it in the map\n"
         "R or Home: back to the start\n"
         "space: turn or look around, on and on\n"
         "C: the cells that are drawn, then also those above them, then none\n"
         "V: the level that each pixel comes from\n"
         "G: gaps filled from the levels above, as background, or magenta\n"
         "T: the detail: how many pixels a sample may be wide\n"
         "P: save a picture\n"
         "K: add a keyframe for ldi render --path\n"
         "Tab: panel on and off\n"
         "H: this help\n"
         "Esc: quit";
}

std::string walk_window_help() {
  return "W, S or up, down: walk forwards, backwards\n"
         "A, D: sideways\n"
         "left, right: turn\n"
         "E, Q or page up, page down: raise, lower the eye\n"
         "shift: three times as fast\n"
         "left drag: look around\n"
         "right, middle or shift drag: sideways, up and down\n"
         "wheel: forwards, backwards\n"
         "1-9, N, B: to a node, the next, the one before; or click it in the map\n"
         "R or Home: back to the first node\n"
         "space: look around, on and on\n"
         "M: the next way to merge nodes (in a set's window M measures, N marks points)\n"
         "F: fill gaps from further nodes, or not\n"
         "G: gaps as background, interpolated, or magenta\n"
         "V: which node each pixel comes from\n"
         "T: the triangles\n"
         "L: leave the box that was made to be walked in\n"
         "P: save a picture\n"
         "K: add a keyframe for walkthrough render --path\n"
         "Tab: panel on and off\n"
         "H: this help\n"
         "Esc: quit";
}

}  // namespace scanview
