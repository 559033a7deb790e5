#pragma once
#include <optional>
#include <string>

#include "viewer/window/walk_control.h"

namespace scanview {

/// What clicks and drags are for.
enum class WindowMode {
  look,     ///< drags turn, a double click sets the pivot
  measure,  ///< the same; clicks are the ends of a distance
  mark,     ///< over one view's picture: clicks are numbered points for `register --init`
  outline,  ///< over one view's picture: clicks are corners of polygons for `mesh --marks`
};

/// Whether a single view's picture is shown flat instead of the object.
constexpr bool shows_picture(WindowMode mode) { return mode == WindowMode::mark || mode == WindowMode::outline; }

/// What a key or a button of the panel asks for.
enum class Command {
  quit,
  help,
  toggle_panel,
  reset,
  save_picture,
  turntable,
  add_keyframe,
  remove_keyframe,
  look,
  measure,
  mark,
  outline,
  previous_view,
  next_view,
  previous_point,
  next_point,
  remove_last,
  close_outline,
  // Of a model's window:
  freeze_eye,
  toggle_visibility,
  toggle_facing,
  toggle_culled,
  toggle_lines,
  add_camera,
  next_up,
  // Of a walkthrough's window:
  next_policy,
  next_gaps,
  toggle_filling,
  toggle_sources,
  toggle_triangles,
  toggle_free,
  previous_node,
  next_node,
  // Of a tree's window:
  next_detail,
  next_cells,
  toggle_levels,
  toggle_walking,
};

/// The command of a key (GLFW's number); nothing where it has none in this mode. M, N and O lead into their modes and,
/// pressed there, back; Escape leaves a mode before it closes the window.
std::optional<Command> command_of_key(int key, WindowMode mode);

/// The same in the window of a model, which has no modes.
std::optional<Command> model_command_of_key(int key);

/// The same in the window of a walkthrough, for keys that do something once.
std::optional<Command> walk_command_of_key(int key);

/// The same in the window of an LDI tree.
std::optional<Command> tree_command_of_key(int key);

/// What a key does for as long as it is held in the window of a walkthrough, and of a tree that is walked in: a step of
/// length 1, or the degrees of a quick look around, in a second.
std::optional<WalkStep> walk_step_of_key(int key);

/// 0 to 8 for the keys 1 to 9.
std::optional<std::size_t> view_of_key(int key);

/// The mouse and the keys, one a line.
std::string window_help();
std::string model_window_help();
std::string walk_window_help();
std::string tree_window_help();

}  // namespace scanview
