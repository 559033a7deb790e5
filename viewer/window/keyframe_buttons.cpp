#include "viewer/window/keyframe_buttons.h"

#include <imgui.h>

namespace scanview {

void draw_keyframe_buttons(std::size_t keyframes, std::string const& render_command, int& frames_between,
                           std::vector<Command>& commands) {
  if (ImGui::SmallButton("keyframe (K)")) commands.push_back(Command::add_keyframe);
  ImGui::SameLine();
  ImGui::Text("%zu", keyframes);
  if (keyframes == 0) return;
  ImGui::SameLine();
  if (ImGui::SmallButton("remove")) commands.push_back(Command::remove_keyframe);
  ImGui::PushItemWidth(0.35F * ImGui::GetContentRegionAvail().x);
  ImGui::SliderInt("frames between", &frames_between, 1, 240, "%d", ImGuiSliderFlags_AlwaysClamp);
  ImGui::PopItemWidth();
  ImGui::TextWrapped("%s", render_command.c_str());
}

}  // namespace scanview
