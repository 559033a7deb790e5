#include "viewer/window/map_canvas.h"

#include <fmt/format.h>

#include <algorithm>

namespace scanview {

MapCanvas MapCanvas::begin(float scale) {
  MapCanvas canvas;
  canvas.corner = ImGui::GetCursorScreenPos();
  canvas.width = std::max(1.0F, ImGui::GetContentRegionAvail().x);
  canvas.scale = scale;
  ImVec2 const size(canvas.width, canvas.width * static_cast<float>(GroundMap::kHeight));
  ImGui::InvisibleButton("map", size);
  ImVec2 const end(canvas.corner.x + size.x, canvas.corner.y + size.y);
  canvas.list = ImGui::GetWindowDrawList();
  canvas.list->PushClipRect(canvas.corner, end, true);
  canvas.list->AddRectFilled(canvas.corner, end, IM_COL32(30, 34, 40, 255), 3);
  return canvas;
}

void MapCanvas::draw_view(GroundMap const& map) const {
  ImVec2 const eye = place(map.eye), left = place(map.view[0]), right = place(map.view[1]);
  list->AddTriangleFilled(eye, left, right, IM_COL32(255, 220, 90, 60));
  list->AddLine(eye, left, IM_COL32(255, 220, 90, 220));
  list->AddLine(eye, right, IM_COL32(255, 220, 90, 220));
}

void MapCanvas::draw_eye(GroundMap const& map) const {
  list->AddCircleFilled(place(map.eye), 3 * scale, IM_COL32(255, 220, 90, 255));
}

void MapCanvas::draw_bar(GroundMap const& map, Unit unit) const {
  float const below = width * static_cast<float>(GroundMap::kHeight);
  ImVec2 const from(corner.x + 8 * scale, corner.y + below - 6 * scale);
  ImVec2 const to(from.x + width * static_cast<float>(map.bar_width), from.y);
  ImU32 const light = IM_COL32(200, 205, 215, 255);
  list->AddLine(from, to, light, 2);
  std::string const text = short_length(map.bar, unit);
  list->AddText(ImVec2(from.x, from.y - ImGui::GetTextLineHeight() - 1), light, text.c_str());
}

Eigen::Vector2d MapCanvas::pointer() const {
  ImVec2 const mouse = ImGui::GetIO().MousePos;
  return {(mouse.x - corner.x) / width, (mouse.y - corner.y) / width};
}

std::string short_length(double length, Unit unit) {
  if (unit == Unit::arbitrary) return fmt::format("{:.3g}", length);
  return fmt::format("{:.3g} {}", length, to_string(unit));
}

}  // namespace scanview
