#include "viewer/window/outline_marks.h"

#include <cmath>

namespace scanview {

std::string to_string(OutlineKind kind) {
  return kind == OutlineKind::keep ? "keep" : kind == OutlineKind::remove ? "remove" : "cut";
}

void OutlineMarks::add_corner(std::string const& view, Eigen::Vector2d const& pixel) {
  if (view != drawn_in_) drawn_.clear();
  drawn_in_ = view;
  drawn_.push_back(pixel);
}

std::string OutlineMarks::close(OutlineKind kind) {
  std::size_t const least = kind == OutlineKind::cut ? 2 : 3;
  if (drawn_.size() < least)
    return kind == OutlineKind::cut ? "a cut needs two corners or more" : "an outline needs three corners or more";
  views_[drawn_in_].push_back({kind, std::move(drawn_)});
  drawn_ = {};
  return {};
}

bool OutlineMarks::remove_last(std::string const& view) {
  if (view == drawn_in_ && !drawn_.empty()) {
    drawn_.pop_back();
    return true;
  }
  auto const found = views_.find(view);
  if (found == views_.end()) return false;
  found->second.pop_back();
  if (found->second.empty()) views_.erase(found);
  return true;
}

MeshMarks::Polygon OutlineMarks::open(std::string const& view) const {
  return view == drawn_in_ ? drawn_ : MeshMarks::Polygon{};
}

std::vector<OutlineMarks::Outline> const& OutlineMarks::of(std::string const& view) const {
  static std::vector<Outline> const none;
  auto const found = views_.find(view);
  return found == views_.end() ? none : found->second;
}

bool OutlineMarks::empty() const { return views_.empty(); }

Json OutlineMarks::to_json() const {
  Json json = Json::object();
  for (auto const& [view, outlines] : views_) {
    for (auto const& outline : outlines) {
      Json corners = Json::array();
      for (auto const& corner : outline.corners)
        corners.push_back({std::round(100 * corner.x()) / 100, std::round(100 * corner.y()) / 100});
      json[view][to_string(outline.kind)].push_back(std::move(corners));
    }
  }
  return json;
}

OutlineMarks OutlineMarks::from_json(Json const& json, std::filesystem::path const& path) {
  OutlineMarks result;
  for (auto const& [view, marks] : mesh_marks_from_json(json, path)) {
    if (marks.empty()) continue;
    auto& outlines = result.views_[view];
    for (auto const& corners : marks.keep) outlines.push_back({OutlineKind::keep, corners});
    for (auto const& corners : marks.remove) outlines.push_back({OutlineKind::remove, corners});
    for (auto const& corners : marks.cut) outlines.push_back({OutlineKind::cut, corners});
  }
  return result;
}

}  // namespace scanview
