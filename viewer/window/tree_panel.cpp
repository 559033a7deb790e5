#include "viewer/window/tree_panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <iterator>

#include "viewer/window/keyframe_buttons.h"
#include "viewer/window/map_canvas.h"

namespace scanview {
namespace {

ImU32 color_of(Eigen::Vector3f const& rgb, float alpha) {
  return ImGui::GetColorU32(ImVec4(rgb.x(), rgb.y(), rgb.z(), alpha));
}

template <typename Choice>
void radio(std::string const& label, Choice& current, Choice value) {
  if (ImGui::RadioButton(label.c_str(), current == value)) current = value;
}

void draw_map(TreePanelContent const& content, float scale, TreePanelAnswer& answer) {
  CellMap const& map = content.map;
  MapCanvas canvas = MapCanvas::begin(scale);
  for (CellMap::Cell const& cell : map.cells) {
    ImVec2 const low = canvas.place(cell.low), high = canvas.place(cell.high);
    canvas.list->AddRectFilled(low, high, color_of(cell.color, 0.2F));
    canvas.list->AddRect(low, high, color_of(cell.color, 0.7F));
  }
  for (CellMap::Dot const& dot : map.views)
    canvas.list->AddCircleFilled(canvas.place(dot.at), 2 * scale, IM_COL32(235, 238, 245, 200));
  canvas.draw_view(map);
  canvas.draw_eye(map);
  canvas.draw_bar(map, content.unit);
  canvas.end();
  if (!ImGui::IsItemHovered()) return;
  constexpr double kReach = 0.03;
  auto const view = map.nearest(canvas.pointer(), kReach);
  if (!view) return;
  ImGui::SetTooltip("view %s: click to go there", content.view_names.at(*view).c_str());
  if (ImGui::IsItemClicked()) answer.jump = view;
}

void draw_choices(TreePanelContent& content, TreePanelAnswer& answer) {
  TreeLook& look = content.look;
  bool const walking = content.mode == TreeEye::Mode::walk;
  if (ImGui::RadioButton("go around", !walking) && walking) answer.commands.push_back(Command::toggle_walking);
  ImGui::SameLine();
  if (ImGui::RadioButton("walk", walking) && !walking) answer.commands.push_back(Command::toggle_walking);
  ImGui::SameLine();
  ImGui::TextDisabled("(O)");
  ImGui::TextUnformatted("samples, pixels wide (T)");
  for (double const size : kStampSizes) {
    radio(fmt::format("{:g}", size), look.stamp_px, size);
    if (size != *std::rbegin(kStampSizes)) ImGui::SameLine();
  }
  ImGui::TextUnformatted("gaps (G)");
  radio("filled", look.gaps, TreeGaps::filled);
  ImGui::SameLine();
  radio("dark", look.gaps, TreeGaps::background);
  ImGui::SameLine();
  radio("magenta", look.gaps, TreeGaps::magenta);
  ImGui::TextUnformatted("cells (C)");
  radio("none", look.cells, ShownCells::none);
  ImGui::SameLine();
  radio("drawn", look.cells, ShownCells::drawn);
  ImGui::SameLine();
  radio("and above", look.cells, ShownCells::traversed);
  ImGui::Checkbox("levels in colours (V)", &look.levels);
}

void draw_buttons(TreePanelContent& content, TreePanelAnswer& answer) {
  auto const button = [&](char const* label, Command command) {
    if (ImGui::SmallButton(label)) answer.commands.push_back(command);
  };
  button("< view (B)", Command::previous_view);
  ImGui::SameLine();
  button("view > (N)", Command::next_view);
  ImGui::SameLine();
  button("reset (R)", Command::reset);
  button(content.turning ? "stop (space)" : "turn (space)", Command::turntable);
  ImGui::SameLine();
  button("help (H)", Command::help);
  button("picture (P)", Command::save_picture);
  ImGui::SameLine();
  draw_keyframe_buttons(content.keyframes, content.keyframe_command, content.frames_between, answer.commands);
}

void draw_levels(TreePanelContent const& content) {
  for (auto const& line : content.levels) {
    float const side = ImGui::GetTextLineHeight();
    ImVec2 const corner = ImGui::GetCursorScreenPos();
    ImGui::GetWindowDrawList()->AddRectFilled(ImVec2(corner.x + 0.15F * side, corner.y + 0.15F * side),
                                              ImVec2(corner.x + 0.85F * side, corner.y + 0.85F * side),
                                              color_of(line.color, 1));
    ImGui::SetCursorPosX(ImGui::GetCursorPosX() + 1.4F * side);
    ImGui::TextUnformatted(line.text.c_str());
  }
}

}  // namespace

std::string level_text(LevelCount const& count, Unit unit) {
  std::string text = fmt::format("{}: {} drawn", short_length(ldi_step(count.level), unit), count.drawn);
  if (count.descended > 0) text += fmt::format(", {} above", count.descended);
  return text;
}

std::vector<std::string> tree_frame_text(TreePanelContent const& content) {
  constexpr double kMegabyte = 1 << 20, kMillion = 1e6;
  constexpr char const* kProgress[] = {"refining", "complete", "complete but for damage"};
  TreeFigures const& figures = content.figures;
  std::vector<std::string> lines = {
      fmt::format("{}, {:.1f} ms", kProgress[static_cast<std::size_t>(content.progress)], figures.milliseconds),
      fmt::format("{} cells traversed, {:.2f} M splats", figures.cells, static_cast<double>(figures.splats) / kMillion),
      fmt::format("gaps {:.3g} %, uncovered {:.3g} %", 100 * figures.gaps, 100 * figures.uncovered),
      fmt::format("tree: {} cells, {:.1f} MB", content.cells, static_cast<double>(content.bytes) / kMegabyte)};
  return lines;
}

TreePanelAnswer draw_tree_panel(PanelFrame& frame, TreePanelContent& content, Overlay const& overlay,
                                Viewport const& viewport) {
  TreePanelAnswer answer;
  frame.draw(content, overlay, viewport, [&] {
    draw_map(content, frame.scale(), answer);
    draw_choices(content, answer);
    ImGui::Separator();
    draw_buttons(content, answer);
    ImGui::Separator();
    for (auto const& line : tree_frame_text(content)) ImGui::TextUnformatted(line.c_str());
    draw_levels(content);
    if (content.failures.empty()) return;
    ImGui::Separator();
    ImGui::TextColored(ImVec4(1, 0.5F, 0.4F, 1), "the tree is damaged");
    for (auto const& line : content.failures) ImGui::TextWrapped("%s", line.c_str());
  });
  return answer;
}

}  // namespace scanview
