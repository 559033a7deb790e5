#include "viewer/window/model_panel.h"

#include <imgui.h>

namespace scanview {
namespace {

double percent(std::size_t part, std::size_t all) {
  return all == 0 ? 0 : 100 * static_cast<double>(part) / static_cast<double>(all);
}

void draw_figures(ModelPanelContent const& content) {
  ModelFigures const& figures = content.figures;
  if (content.polygons == content.triangles) {
    ImGui::Text("%zu triangles", content.triangles);
  } else {
    ImGui::Text("%zu polygons, %zu triangles", content.polygons, content.triangles);
  }
  double const drawn = percent(figures.triangles, content.triangles);
  ImGui::Text("drawn %zu, %.1f %%", figures.triangles, drawn);
  if (content.look.lines) ImGui::Text("lines %zu", figures.lines);
  if (!content.has_visibility) {
    ImGui::TextWrapped("nothing is known about what can be seen: --visibility FILE");
    return;
  }
  ImGui::Text("culling rate %.1f %%", 100 - drawn);
  ImGui::Text("ranges %zu", figures.ranges);
  ImGui::Text("patches %zu of %zu", figures.patches, content.patches);
  ImGui::Text("chosen in %.1f us", figures.select_microseconds);
  if (content.nearest_sample > 0)
    ImGui::Text("eye at %.2f radii, samples from %.2f", content.distance, content.nearest_sample);
  if (figures.is_whole && content.look.visibility) {
    ImGui::PushStyleColor(ImGuiCol_Text, ImVec4(1, 0.8F, 0.4F, 1));
    ImGui::TextWrapped("the whole model: nothing is known of this eye%s",
                       content.nearest_sample > content.distance ? ", nearer than the samples" : "");
    ImGui::PopStyleColor();
  }
}

void draw_choices(ModelPanelContent const& content, std::vector<Command>& commands) {
  auto const toggle = [&](char const* label, bool on, Command command) {
    if (ImGui::Checkbox(label, &on)) commands.push_back(command);
  };
  if (content.has_visibility) {
    toggle("only what can be seen (V)", content.look.visibility, Command::toggle_visibility);
    toggle("and what faces the eye (T)", content.look.facing, Command::toggle_facing);
    toggle("frozen eye (F)", content.frozen, Command::freeze_eye);
    toggle("the rest, faintly (G)", content.look.culled, Command::toggle_culled);
  }
  toggle("lines on paper (N)", content.look.lines, Command::toggle_lines);
}

void draw_buttons(ModelPanelContent const& content, std::vector<Command>& commands) {
  auto const button = [&](char const* label, Command command) {
    if (ImGui::SmallButton(label)) commands.push_back(command);
  };
  button("reset (R)", Command::reset);
  ImGui::SameLine();
  button(content.turning ? "stop (space)" : "turntable (space)", Command::turntable);
  button("picture (P)", Command::save_picture);
  ImGui::SameLine();
  button("help (H)", Command::help);
  button("up (U)", Command::next_up);
  ImGui::SameLine();
  button("camera (C)", Command::add_camera);
  ImGui::SameLine();
  ImGui::Text("%zu", content.cameras);
  if (!content.camera_file.empty()) ImGui::TextWrapped("%s", content.camera_file.c_str());
}

}  // namespace

std::vector<Command> draw_model_panel(PanelFrame& frame, ModelPanelContent const& content, Overlay const& overlay,
                                      Viewport const& viewport) {
  std::vector<Command> commands;
  frame.draw(content, overlay, viewport, [&] {
    draw_figures(content);
    ImGui::Separator();
    draw_choices(content, commands);
    ImGui::Separator();
    draw_buttons(content, commands);
  });
  return commands;
}

}  // namespace scanview
