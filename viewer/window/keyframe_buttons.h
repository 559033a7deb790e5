#pragma once
#include <string>
#include <vector>

#include "viewer/window/commands.h"

namespace scanview {

/// The part of a panel that keeps a camera path: adds what is pressed to `commands` and, where there are keyframes,
/// lets the frames between them be chosen and shows the command that renders them (Dear ImGui).
void draw_keyframe_buttons(std::size_t keyframes, std::string const& render_command, int& frames_between,
                           std::vector<Command>& commands);

}  // namespace scanview
