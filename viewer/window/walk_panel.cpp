#include "viewer/window/walk_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

#include "base/srgb.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/window/keyframe_buttons.h"
#include "viewer/window/map_canvas.h"

namespace scanview {
namespace {

/// A node's false colour as pictures show it.
ImU32 hue_of(std::size_t node, float alpha = 1) {
  auto const shown = [hue = view_hue(node)](int c) { return static_cast<float>(srgb_from_linear(hue[c])); };
  return ImGui::GetColorU32(ImVec4(shown(0), shown(1), shown(2), alpha));
}

void draw_dot(MapCanvas const& canvas, NodeMap::Dot const& dot) {
  ImDrawList& list = *canvas.list;
  ImVec2 const at = canvas.place(dot.at);
  if (dot.failed) {
    float const arm = 4 * canvas.scale;
    ImU32 const red = IM_COL32(255, 110, 90, 255);
    list.AddLine(ImVec2(at.x - arm, at.y - arm), ImVec2(at.x + arm, at.y + arm), red, 2);
    list.AddLine(ImVec2(at.x - arm, at.y + arm), ImVec2(at.x + arm, at.y - arm), red, 2);
    return;
  }
  auto const weight = static_cast<float>(dot.weight);
  float const size = canvas.scale * (dot.drawn ? 3.5F + 2.5F * weight : 2.5F);
  // Those that fill are drawn, but fainter than those that are merged.
  float const alpha = dot.weight > 0 ? 0.6F + 0.4F * std::sqrt(weight) : 0.45F;
  list.AddCircleFilled(at, size, dot.drawn ? hue_of(dot.node, alpha) : IM_COL32(153, 158, 168, 200));
  if (dot.weight > 0) list.AddCircle(at, size + 1, IM_COL32(255, 255, 255, 255));
}

void draw_map(WalkPanelContent const& content, float scale, WalkPanelAnswer& answer) {
  NodeMap const& map = content.map;
  MapCanvas canvas = MapCanvas::begin(scale);
  for (auto const& edge : map.edges)
    canvas.list->AddLine(canvas.place(edge[0]), canvas.place(edge[1]), IM_COL32(90, 95, 105, 255));
  canvas.draw_view(map);
  for (auto const& dot : map.dots) draw_dot(canvas, dot);
  canvas.draw_eye(map);
  canvas.draw_bar(map, content.unit);
  canvas.end();
  if (!ImGui::IsItemHovered()) return;
  constexpr double kReach = 0.05;
  std::size_t const node = map.nearest(canvas.pointer(), kReach);
  if (node >= content.names.size()) return;
  ImGui::SetTooltip("node %s: click to go there", content.names[node].c_str());
  if (ImGui::IsItemClicked()) answer.jump = node;
}

template <typename Choice>
void radio(std::string const& label, Choice& current, Choice value) {
  if (ImGui::RadioButton(label.c_str(), current == value)) current = value;
}

void draw_choices(WalkPanelContent& content, WalkPanelAnswer& answer) {
  WalkLook& look = content.look;
  float const second = 0.5F * ImGui::GetContentRegionAvail().x;
  ImGui::TextUnformatted("merging (M)");
  for (MergePolicy const policy : kMergePolicies) {
    radio(to_string(policy), look.policy, policy);
    if (policy == MergePolicy::layering || policy == MergePolicy::weighted) ImGui::SameLine(second);
  }
  ImGui::PushItemWidth(0.4F * ImGui::GetContentRegionAvail().x);
  ImGui::SliderInt("nodes merged", &look.merged, 1, 16, "%d", ImGuiSliderFlags_AlwaysClamp);
  ImGui::Checkbox("fill gaps (F)", &look.fills);
  if (look.fills) ImGui::SliderInt("nodes that fill", &look.filling, 1, 64, "%d", ImGuiSliderFlags_AlwaysClamp);
  ImGui::PopItemWidth();
  ImGui::TextUnformatted("gaps that remain (G)");
  radio("dark", look.gaps, GapLook::background);
  ImGui::SameLine();
  radio("smooth", look.gaps, GapLook::interpolated);
  ImGui::SameLine();
  radio("magenta", look.gaps, GapLook::magenta);
  ImGui::Checkbox("fade at silhouettes", &look.fades);
  using Show = WalkthroughOptions::Show;
  radio("picture", look.show, Show::picture);
  ImGui::SameLine();
  radio("nodes (V)", look.show, Show::sources);
  ImGui::SameLine();
  radio("mesh (T)", look.show, Show::triangles);
  bool free = content.is_free;
  if (content.has_box && ImGui::Checkbox("also outside the box (L)", &free))
    answer.commands.push_back(Command::toggle_free);
}

void draw_buttons(WalkPanelContent& content, WalkPanelAnswer& answer) {
  auto const button = [&](char const* label, Command command) {
    if (ImGui::SmallButton(label)) answer.commands.push_back(command);
  };
  button("< node (B)", Command::previous_node);
  ImGui::SameLine();
  button("node > (N)", Command::next_node);
  ImGui::SameLine();
  button("first (R)", Command::reset);
  button(content.turning ? "stop (space)" : "look around (space)", Command::turntable);
  ImGui::SameLine();
  button("help (H)", Command::help);
  button("picture (P)", Command::save_picture);
  ImGui::SameLine();
  draw_keyframe_buttons(content.keyframes, content.keyframe_command, content.frames_between, answer.commands);
}

void draw_used(WalkPanelContent const& content, float scale) {
  for (UsedNode const& used : content.used) {
    float const side = ImGui::GetTextLineHeight();
    ImVec2 const corner = ImGui::GetCursorScreenPos();
    ImGui::GetWindowDrawList()->AddCircleFilled(ImVec2(corner.x + 0.5F * side, corner.y + 0.5F * side), 4 * scale,
                                                hue_of(used.node));
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + 1.4F * side);
    ImGui::TextUnformatted(used_node_text(content, used).c_str());
  }
}

}  // namespace

std::string used_node_text(WalkPanelContent const& content, UsedNode const& used) {
  std::string const share = used.weight > 0 ? fmt::format("{:3.0f} %", 100 * used.weight) : "fills";
  return fmt::format("{} {} {:>8} {:6} tri.", content.names.at(used.node), share,
                     short_length(used.distance, content.unit), used.triangles);
}

std::vector<std::string> walk_frame_text(WalkPanelContent const& content) {
  std::vector<std::string> lines = {fmt::format("uncovered {:.3g} %", 100 * content.uncovered)};
  for (auto const& [name, milliseconds] : content.stages)
    lines.push_back(fmt::format("{} {:.1f} ms", name, milliseconds));
  constexpr double kMegabyte = 1 << 20;
  lines.push_back(fmt::format("in memory {} of {} nodes, {:.0f} MB", content.traffic.nodes, content.names.size(),
                              static_cast<double>(content.traffic.bytes) / kMegabyte));
  return lines;
}

WalkPanelAnswer draw_walk_panel(PanelFrame& frame, WalkPanelContent& content, Overlay const& overlay,
                                Viewport const& viewport) {
  WalkPanelAnswer answer;
  frame.draw(content, overlay, viewport, [&] {
    draw_map(content, frame.scale(), answer);
    draw_choices(content, answer);
    ImGui::Separator();
    draw_buttons(content, answer);
    ImGui::Separator();
    draw_used(content, frame.scale());
    for (auto const& line : walk_frame_text(content)) ImGui::TextUnformatted(line.c_str());
    if (content.failures.empty()) return;
    ImGui::Separator();
    ImGui::TextColored(ImVec4(1, 0.5F, 0.4F, 1), "nodes that cannot be read: %zu", content.failures.size());
    for (auto const& line : content.failures) ImGui::TextWrapped("%s", line.c_str());
  });
  return answer;
}

}  // namespace scanview
