#include "viewer/window/measuring.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace scanview {

std::optional<Eigen::Vector3d> ShownFrame::pick(double x, double y, int width, int height) const {
  if (frame.depth.empty() || width < 1 || height < 1) return std::nullopt;
  double const u = (x + 0.5) * frame.depth.cols / width - 0.5, v = (y + 0.5) * frame.depth.rows / height - 0.5;
  if (!camera.contains({u, v})) return std::nullopt;
  int const column = std::min(static_cast<int>(std::floor(u + 0.5)), frame.depth.cols - 1);
  int const row = std::min(static_cast<int>(std::floor(v + 0.5)), frame.depth.rows - 1);
  float const depth = frame.depth(row, column);
  if (!std::isfinite(depth)) return std::nullopt;
  return object_from_camera * camera.unproject(u, v, depth);
}

std::optional<Eigen::Vector2d> ShownFrame::place(Eigen::Vector3d const& p_object, int width, int height) const {
  if (camera.width() < 1 || camera.height() < 1) return std::nullopt;
  Eigen::Vector2d const pixel = camera.project(object_from_camera.inverse() * p_object);
  if (!pixel.allFinite()) return std::nullopt;
  return Eigen::Vector2d((pixel.x() + 0.5) * width / camera.width() - 0.5,
                         (pixel.y() + 0.5) * height / camera.height() - 0.5);
}

void DistanceTool::click(std::optional<Eigen::Vector3d> const& p_object) {
  if (!p_object || !p_object->allFinite()) return;
  if (points_.size() == 2) points_.clear();
  points_.push_back(*p_object);
}

void DistanceTool::remove_last() {
  if (!points_.empty()) points_.pop_back();
}

std::optional<double> DistanceTool::distance() const {
  if (points_.size() != 2) return std::nullopt;
  return (points_[1] - points_[0]).norm();
}

Overlay DistanceTool::overlay(ShownFrame const& shown, int width, int height, Unit unit) const {
  Overlay overlay;
  Eigen::Vector3f const yellow(1, 0.85F, 0.2F);
  Overlay::Line line{{}, yellow, false};
  for (auto const& p : points_) {
    auto const at = shown.place(p, width, height);
    if (!at) continue;
    line.points.push_back(*at);
    overlay.dots.push_back({*at, yellow, ""});
  }
  if (points_.size() == 2 && line.points.size() == 2) overlay.dots.back().label = length_text(*distance(), unit);
  overlay.lines.push_back(std::move(line));
  return overlay;
}

std::string length_text(double length, Unit unit) {
  return fmt::format("{:.4g} {}", length, unit == Unit::arbitrary ? "(no known scale)" : to_string(unit));
}

}  // namespace scanview
