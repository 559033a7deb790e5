#pragma once
#include <imgui.h>

#include <Eigen/Core>
#include <string>

#include "acquire/scan_set.h"
#include "viewer/window/ground_map.h"

namespace scanview {

/// A map's place in a panel, and what every map shows. All in one pass of Dear ImGui's, from begin() to end().
class MapCanvas {
 public:
  /// As wide as the panel; `scale`: of letters, to the usual size.
  static MapCanvas begin(float scale);
  void end() { list->PopClipRect(); }

  ImVec2 place(Eigen::Vector2d const& p) const {
    return {corner.x + width * static_cast<float>(p.x()), corner.y + width * static_cast<float>(p.y())};
  }
  /// What the eye sees, and from where.
  void draw_view(GroundMap const& map) const;
  void draw_eye(GroundMap const& map) const;
  void draw_bar(GroundMap const& map, Unit unit) const;
  /// Where the pointer is on the map; it may be elsewhere.
  Eigen::Vector2d pointer() const;

  ImDrawList* list = nullptr;
  ImVec2 corner;
  float width = 1, scale = 1;
};

/// "0.842 m"; without a unit where none is known.
std::string short_length(double length, Unit unit);

}  // namespace scanview
