#include "viewer/window/panel_frame.h"

#include <backends/imgui_impl_glfw.h>
#include <backends/imgui_impl_opengl3.h>
#include <imgui.h>

#include <algorithm>
#include <cmath>

namespace scanview {
namespace {

constexpr float kWidth = 292;  // units of the screen at the usual size of letters

ImU32 color(Eigen::Vector3f const& rgb, float alpha = 1) {
  return ImGui::GetColorU32(ImVec4(rgb.x(), rgb.y(), rgb.z(), alpha));
}

void draw_times(PanelStatus const& status) {
  double const total = status.frame_milliseconds + status.panel_milliseconds;
  ImGui::Text("%.0f frames/s%s%s", total > 0 ? 1000 / total : 0, status.half_resolution ? ", half resolution" : "",
              status.reading ? ", reading" : "");
  ImGui::Text("frame %.1f ms, panel %.1f ms", status.frame_milliseconds, status.panel_milliseconds);
}

void draw_overlay(Overlay const& overlay, ImVec2 const& corner, ImVec2 const& size, float scale) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  list.PushClipRect(corner, ImVec2(corner.x + size.x, corner.y + size.y));
  auto const place = [&](Eigen::Vector2d const& p) {
    return ImVec2(corner.x + static_cast<float>(p.x() + 0.5) / scale,
                  corner.y + static_cast<float>(p.y() + 0.5) / scale);
  };
  for (auto const& line : overlay.lines) {
    std::size_t const count = line.points.size() < 2 ? 0 : line.points.size() - (line.closed ? 0 : 1);
    for (std::size_t i = 0; i < count; ++i) {
      ImVec2 const a = place(line.points[i]), b = place(line.points[(i + 1) % line.points.size()]);
      list.AddLine(a, b, IM_COL32(0, 0, 0, 160), 4);
      list.AddLine(a, b, color(line.color), 2);
    }
  }
  for (auto const& dot : overlay.dots) {
    ImVec2 const at = place(dot.at);
    list.AddCircleFilled(at, 4, IM_COL32(0, 0, 0, 200));
    list.AddCircleFilled(at, 3, color(dot.color));
    if (dot.label.empty()) continue;
    ImVec2 const from(at.x + 8, at.y - 18), text = ImGui::CalcTextSize(dot.label.c_str());
    list.AddRectFilled(ImVec2(from.x - 3, from.y - 2), ImVec2(from.x + text.x + 3, from.y + text.y + 2),
                       IM_COL32(0, 0, 0, 180), 3);
    list.AddText(from, color(dot.color), dot.label.c_str());
  }
  list.PopClipRect();
}

void draw_message(std::string const& message, ImVec2 const& corner, ImVec2 const& size) {
  ImDrawList& list = *ImGui::GetBackgroundDrawList();
  float const width = std::max(1.0F, size.x - 32);
  ImVec2 const text = ImGui::CalcTextSize(message.c_str(), nullptr, false, width);
  ImVec2 const from(corner.x + 16, corner.y + size.y - text.y - 16);
  list.AddRectFilled(ImVec2(from.x - 6, from.y - 4), ImVec2(from.x + text.x + 6, from.y + text.y + 4),
                     IM_COL32(0, 0, 0, 190), 4);
  list.AddText(nullptr, 0, from, IM_COL32(235, 235, 235, 255), message.c_str(), nullptr, width);
}

}  // namespace

PanelFrame::PanelFrame(GlfwWindow& window) : window_(window), scale_(static_cast<float>(window.content_scale())) {
  IMGUI_CHECKVERSION();
  ImGui::CreateContext();
  ImGuiIO& io = ImGui::GetIO();
  io.IniFilename = nullptr;  // leaves no file where it was started
  io.LogFilename = nullptr;
  ImGui::StyleColorsDark();
  ImGui::GetStyle().ScaleAllSizes(scale_);
  ImGui::GetStyle().WindowRounding = 0;
  ImFontConfig font;
  font.SizePixels = std::floor(13 * scale_);
  io.Fonts->AddFontDefault(&font);
  ImGui_ImplGlfw_InitForOpenGL(window.handle(), true);  // calls what the window listens with, too
  ImGui_ImplOpenGL3_Init("#version 330 core");
}

PanelFrame::~PanelFrame() {
  ImGui_ImplOpenGL3_Shutdown();
  ImGui_ImplGlfw_Shutdown();
  ImGui::DestroyContext();
}

bool PanelFrame::takes_keys() const { return visible && ImGui::GetIO().WantTextInput; }

Viewport PanelFrame::viewport(int width, int height, float strip_height) const {
  if (!visible) return {0, 0, width, height};
  double const pixels = scale_ * window_.pixels_per_unit();
  // In a small window the picture comes first.
  int const left = std::min(static_cast<int>(kWidth * pixels), width / 2);
  int const below = std::min(static_cast<int>(strip_height * pixels), height / 4);
  return {left, 0, std::max(1, width - left), std::max(1, height - below)};
}

void PanelFrame::draw(PanelStatus const& status, Overlay const& overlay, Viewport const& viewport,
                      std::function<void()> const& panel, std::function<void()> const& strip) {
  ImGui_ImplOpenGL3_NewFrame();
  ImGui_ImplGlfw_NewFrame();
  ImGui::NewFrame();
  auto const pixels = static_cast<float>(window_.pixels_per_unit());
  ImVec2 const all = ImGui::GetIO().DisplaySize;
  ImVec2 const corner(static_cast<float>(viewport.x) / pixels, static_cast<float>(viewport.y) / pixels);
  ImVec2 const size(static_cast<float>(viewport.width) / pixels, static_cast<float>(viewport.height) / pixels);
  draw_overlay(overlay, corner, size, pixels);
  if (visible && !status.message.empty()) draw_message(status.message, corner, size);
  if (visible) {
    constexpr ImGuiWindowFlags kFixed = ImGuiWindowFlags_NoDecoration | ImGuiWindowFlags_NoMove |
                                        ImGuiWindowFlags_NoSavedSettings | ImGuiWindowFlags_NoBringToFrontOnFocus |
                                        ImGuiWindowFlags_NoBackground;
    ImGui::SetNextWindowPos(ImVec2(0, 0));
    ImGui::SetNextWindowSize(ImVec2(corner.x, all.y));
    ImGui::Begin("panel", nullptr, kFixed & ~ImGuiWindowFlags_NoScrollbar);
    ImGui::TextWrapped("%s", status.set_name.c_str());
    draw_times(status);
    ImGui::Separator();
    panel();
    ImGui::End();
    if (strip && size.y < all.y) {
      ImGui::SetNextWindowPos(ImVec2(corner.x, size.y));
      ImGui::SetNextWindowSize(ImVec2(all.x - corner.x, all.y - size.y));
      ImGui::Begin("strip", nullptr, kFixed);
      strip();
      ImGui::End();
    }
  }
  ImGui::Render();
  ImGui_ImplOpenGL3_RenderDrawData(ImGui::GetDrawData());
}

}  // namespace scanview
