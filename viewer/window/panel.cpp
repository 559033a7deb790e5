#include "viewer/window/panel.h"

#include <fmt/format.h>
#include <imgui.h>

#include <algorithm>
#include <cstdint>

#include "viewer/window/keyframe_buttons.h"

namespace scanview {
namespace {

constexpr float kStripHeight = 148;  // units of the screen at the usual size of letters

ImU32 color(Eigen::Vector3f const& rgb, float alpha = 1) {
  return ImGui::GetColorU32(ImVec4(rgb.x(), rgb.y(), rgb.z(), alpha));
}

void lines_of(std::vector<std::string> const& lines) {
  for (auto const& line : lines) ImGui::TextWrapped("%s", line.c_str());
}

template <typename Choice>
void radio(char const* label, Choice& current, Choice value) {
  if (ImGui::RadioButton(label, current == value)) current = value;
}

void draw_stages(PanelContent const& content) {
  for (auto const& [name, milliseconds] : content.stages) {
    ImGui::Bullet();
    ImGui::Text("%s %.2f ms", name.c_str(), milliseconds);
  }
}

void draw_sphere(PanelContent const& content, float scale, PanelAnswer& answer) {
  SphereInset const& sphere = content.sphere;
  float const side = 172 * scale, radius = 0.5F * side - 6 * scale;
  ImVec2 const corner = ImGui::GetCursorScreenPos();
  ImVec2 const middle(corner.x + 0.5F * ImGui::GetContentRegionAvail().x, corner.y + 0.5F * side);
  ImGui::InvisibleButton("sphere", ImVec2(std::max(1.0F, ImGui::GetContentRegionAvail().x), side));
  auto const place = [&](SpherePoint const& p) {
    return ImVec2(middle.x + radius * static_cast<float>(p.x), middle.y + radius * static_cast<float>(p.y));
  };
  ImDrawList& list = *ImGui::GetWindowDrawList();
  list.AddCircleFilled(middle, radius, IM_COL32(30, 34, 40, 255), 64);
  list.AddCircle(middle, radius, IM_COL32(110, 115, 125, 255), 64);
  if (sphere.chosen.size() == 3) {
    list.AddTriangleFilled(place(sphere.chosen[0]), place(sphere.chosen[1]), place(sphere.chosen[2]),
                           IM_COL32(255, 220, 90, 60));
  } else {
    for (auto const& corner_point : sphere.chosen)
      list.AddLine(place(sphere.eye), place(corner_point), IM_COL32(255, 220, 90, 140));
  }
  for (auto const& edge : sphere.edges) {
    for (std::size_t i = 1; i < edge.arc.size(); ++i) {
      bool const front = edge.arc[i - 1].front && edge.arc[i].front;
      list.AddLine(place(edge.arc[i - 1]), place(edge.arc[i]),
                   edge.chosen ? IM_COL32(255, 220, 90, 255)
                   : front     ? IM_COL32(150, 160, 175, 220)
                               : IM_COL32(90, 95, 105, 90),
                   edge.chosen ? 2.0F : 1.0F);
    }
  }
  for (auto const& dot : sphere.views) {
    float const alpha = dot.at.front ? 1.0F : 0.35F;
    float const size = scale * static_cast<float>(dot.drawn ? 3.5 + 3 * dot.weight : 2.5);
    list.AddCircleFilled(place(dot.at), size,
                         dot.drawn ? color(view_hue(dot.view), alpha) : color({0.6F, 0.62F, 0.66F}, alpha));
    if (dot.weight > 0) list.AddCircle(place(dot.at), size + 1, IM_COL32(255, 255, 255, 255));
  }
  ImVec2 const eye = place(sphere.eye);
  list.AddLine(ImVec2(eye.x - 5, eye.y), ImVec2(eye.x + 5, eye.y), IM_COL32(255, 255, 255, 255));
  list.AddLine(ImVec2(eye.x, eye.y - 5), ImVec2(eye.x, eye.y + 5), IM_COL32(255, 255, 255, 255));
  if (!ImGui::IsItemHovered()) return;
  ImVec2 const mouse = ImGui::GetIO().MousePos;
  std::size_t const view = sphere.nearest((mouse.x - middle.x) / radius, (mouse.y - middle.y) / radius, 0.12);
  if (view >= content.view_names.size()) return;
  ImGui::SetTooltip("view %s: click to look from there", content.view_names[view].c_str());
  if (ImGui::IsItemClicked()) answer.jump = view;
}

void draw_look(PanelContent& content, PanelAnswer& answer) {
  Look& look = content.look;
  bool collage = look.collage;
  radio("blended", collage, false);
  ImGui::SameLine();
  radio("naive collage", collage, true);
  look.collage = collage;
  if (!look.collage) {
    ImGui::Checkbox("soft z", &look.soft_z);
    ImGui::Text("weights");
    struct Weight {
      char const* name;
      bool Look::*on;
    };
    constexpr Weight kWeights[] = {
        {"place on the sphere", &Look::barycentric}, {"cos of the angle", &Look::cosine}, {"feather", &Look::feather}};
    for (auto const& weight : kWeights) {
      ImGui::PushID(weight.name);
      ImGui::Checkbox(weight.name, &(look.*weight.on));
      ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize("alone").x - 8);
      if (ImGui::SmallButton("alone"))
        for (auto const& other : kWeights) look.*other.on = other.on == weight.on;
      ImGui::PopID();
    }
    ImGui::PushItemWidth(0.45F * ImGui::GetContentRegionAvail().x);
    if (look.soft_z) {
      auto threshold = static_cast<float>(look.threshold);
      auto const greatest = static_cast<float>(content.greatest_threshold);
      if (ImGui::SliderFloat(fmt::format("threshold ({})", content.unit).c_str(), &threshold, 0, greatest, "%.3g",
                             ImGuiSliderFlags_Logarithmic | ImGuiSliderFlags_AlwaysClamp))
        look.threshold = threshold;
      auto ratio = static_cast<float>(look.reliability_ratio);
      if (ImGui::SliderFloat("reliability", &ratio, 0, 1, "%.2f", ImGuiSliderFlags_AlwaysClamp))
        look.reliability_ratio = ratio;
    }
    ImGui::PopItemWidth();
  }
  ImGui::PushItemWidth(0.45F * ImGui::GetContentRegionAvail().x);
  ImGui::SliderInt("views that fill", &look.fill_views, 0, 16, "%d", ImGuiSliderFlags_AlwaysClamp);
  ImGui::PopItemWidth();
  radio("picture", look.show, SoftZ::Show::picture);
  ImGui::SameLine();
  radio("weights", look.show, SoftZ::Show::weights);
  ImGui::SameLine();
  radio("which won", look.show, SoftZ::Show::winner);
  ImGui::Checkbox("wireframe", &look.wireframe);
  ImGui::SameLine(ImGui::GetContentRegionMax().x - ImGui::CalcTextSize("defaults").x - 8);
  if (ImGui::SmallButton("defaults")) answer.default_look = true;
  for (BackEnd const back_end : content.back_ends) {
    radio(back_end == BackEnd::cpu ? "processor" : "OpenGL", content.back_end, back_end);
    ImGui::SameLine();
  }
  ImGui::TextDisabled("draws");
}

void draw_mode(PanelContent& content, PanelAnswer& answer) {
  struct Mode {
    char const* label;
    WindowMode mode;
    Command command;
  };
  constexpr Mode kModes[] = {{"turn", WindowMode::look, Command::look},
                             {"measure (M)", WindowMode::measure, Command::measure},
                             {"points (N)", WindowMode::mark, Command::mark},
                             {"outlines (O)", WindowMode::outline, Command::outline}};
  for (auto const& mode : kModes) {
    if (ImGui::RadioButton(mode.label, content.mode == mode.mode)) answer.commands.push_back(mode.command);
    if (mode.mode == WindowMode::look || mode.mode == WindowMode::mark) ImGui::SameLine(120);
  }
  if (content.mode == WindowMode::outline) {
    radio("remove", content.outline, OutlineKind::remove);
    ImGui::SameLine();
    radio("keep", content.outline, OutlineKind::keep);
    ImGui::SameLine();
    radio("cut", content.outline, OutlineKind::cut);
    if (ImGui::SmallButton("close (Enter)")) answer.commands.push_back(Command::close_outline);
  }
  if (shows_picture(content.mode)) {
    if (ImGui::SmallButton("< view")) answer.commands.push_back(Command::previous_view);
    ImGui::SameLine();
    if (ImGui::SmallButton("view >")) answer.commands.push_back(Command::next_view);
    ImGui::SameLine();
  }
  if (content.mode != WindowMode::look && ImGui::SmallButton("remove last"))
    answer.commands.push_back(Command::remove_last);
  lines_of(content.mode_text);
}

void draw_buttons(PanelContent& content, PanelAnswer& answer) {
  auto const button = [&](char const* label, Command command, bool same_line = true) {
    if (ImGui::SmallButton(label)) answer.commands.push_back(command);
    if (same_line) ImGui::SameLine();
  };
  button("reset (R)", Command::reset);
  button(content.turning ? "stop (space)" : "turntable (space)", Command::turntable, false);
  button("picture (P)", Command::save_picture);
  button("help (H)", Command::help, false);
  draw_keyframe_buttons(content.keyframes, content.keyframe_command, content.frames_between, answer.commands);
}

void draw_strip(PanelContent const& content, float scale) {
  float const height = ImGui::GetContentRegionAvail().y - ImGui::GetTextLineHeightWithSpacing();
  for (auto const& picture : content.strip) {
    float const width = height * static_cast<float>(picture.width) / static_cast<float>(std::max(1, picture.height));
    ImGui::BeginGroup();
    ImGui::Image(reinterpret_cast<ImTextureID>(static_cast<std::intptr_t>(picture.texture)), ImVec2(width, height),
                 ImVec2(0, 0), ImVec2(1, 1), ImVec4(1, 1, 1, 1),
                 ImVec4(picture.color.x(), picture.color.y(), picture.color.z(), 1));
    ImGui::TextUnformatted(picture.caption.c_str());
    ImGui::EndGroup();
    ImGui::SameLine(0, 8 * scale);
  }
}

}  // namespace

Viewport Panel::viewport(int width, int height, WindowMode mode) const {
  return frame_.viewport(width, height, shows_picture(mode) ? 0 : kStripHeight);
}

PanelAnswer Panel::draw(PanelContent& content, Overlay const& overlay, Viewport const& viewport) {
  PanelAnswer answer;
  auto const panel = [&] {
    if (!shows_picture(content.mode)) {
      draw_sphere(content, frame_.scale(), answer);
      draw_look(content, answer);
      ImGui::Separator();
    }
    draw_mode(content, answer);
    ImGui::Separator();
    draw_buttons(content, answer);
    if (!content.stages.empty()) {
      ImGui::Separator();
      draw_stages(content);
    }
    if (!content.failures.empty()) {
      ImGui::Separator();
      ImGui::TextColored(ImVec4(1, 0.5F, 0.4F, 1), "views that cannot be shown: %zu", content.failures.size());
      lines_of(content.failures);
    }
  };
  frame_.draw(content, overlay, viewport, panel, [&] { draw_strip(content, frame_.scale()); });
  return answer;
}

}  // namespace scanview
