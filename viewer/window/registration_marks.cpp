#include "viewer/window/registration_marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "base/error.h"
#include "base/json_fields.h"

namespace scanview {

void RegistrationMarks::set(std::string const& view, std::string const& name, Eigen::Vector2d const& pixel) {
  auto& marks = views_[view];
  std::erase_if(marks, [&](Mark const& mark) { return mark.name == name; });
  marks.push_back({name, pixel});
}

bool RegistrationMarks::remove_last(std::string const& view) {
  auto const found = views_.find(view);
  if (found == views_.end() || found->second.empty()) return false;
  found->second.pop_back();
  if (found->second.empty()) views_.erase(found);
  return true;
}

std::vector<RegistrationMarks::Mark> const& RegistrationMarks::of(std::string const& view) const {
  static std::vector<Mark> const none;
  auto const found = views_.find(view);
  return found == views_.end() ? none : found->second;
}

bool RegistrationMarks::has(std::string const& view, std::string const& name) const {
  auto const& marks = of(view);
  return std::any_of(marks.begin(), marks.end(), [&](Mark const& mark) { return mark.name == name; });
}

bool RegistrationMarks::empty() const { return views_.empty(); }

int RegistrationMarks::next_number(std::string const& view) const {
  int number = 1;
  while (has(view, std::to_string(number))) ++number;
  return number;
}

std::vector<std::string> RegistrationMarks::unplaced(std::vector<std::string> const& views) const {
  std::set<std::string> placed;
  std::vector<std::string> open = views;
  auto const take = [&](std::vector<std::string>::iterator view) {
    for (auto const& mark : of(*view)) placed.insert(mark.name);
    open.erase(view);
  };
  if (!open.empty() && of(open.front()).size() >= 3) take(open.begin());
  for (bool progress = !placed.empty(); progress;) {
    auto const next = std::find_if(open.begin(), open.end(), [&](std::string const& view) {
      auto const& marks = of(view);
      return std::count_if(marks.begin(), marks.end(), [&](Mark const& m) { return placed.contains(m.name); }) >= 3;
    });
    progress = next != open.end();
    if (progress) take(next);
  }
  return open;
}

Json RegistrationMarks::to_json() const {
  Json views = Json::object();
  for (auto const& [view, marks] : views_) {
    for (auto const& mark : marks)
      views[view][mark.name] = {std::round(100 * mark.pixel.x()) / 100, std::round(100 * mark.pixel.y()) / 100};
  }
  return {{"marks", views}};
}

RegistrationMarks RegistrationMarks::from_json(Json const& json, std::filesystem::path const& path) {
  refuse_unknown_keys(json, {"marks"}, "", path);
  RegistrationMarks result;
  Json const& views = json_member(json, "marks", path);
  auto const refuse = [&](std::string const& why) { throw Error(ErrorCode::bad_input, path, why); };
  if (!views.is_object()) refuse("marks is not {\"VIEW\": {\"POINT\": [u, v], ...}, ...}");
  for (auto const& [view, marks] : views.items()) {
    if (!marks.is_object()) refuse("the marks of view " + view + " are not {\"POINT\": [u, v], ...}");
    for (auto const& [name, pixel] : marks.items()) {
      std::string const where = fmt::format("mark {} of view {}", name, view);
      if (!pixel.is_array() || pixel.size() != 2) refuse(where + " is not [u, v]");
      result.set(view, name, {json_finite(pixel[0], where, path), json_finite(pixel[1], where, path)});
    }
  }
  return result;
}

}  // namespace scanview
