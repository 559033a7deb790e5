#include "mesh/mesh_marks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "base/json_fields.h"

namespace scanview {
namespace {

std::vector<MeshMarks::Polygon> read_polygons(Json const& json, std::size_t least, std::string const& where,
                                              std::filesystem::path const& path) {
  auto const bad = [&](std::string const& what) { throw Error(ErrorCode::bad_input, path, where + ": " + what); };
  if (!json.is_array()) bad("expected a list of polygons");
  std::vector<MeshMarks::Polygon> polygons;
  for (Json const& points : json) {
    if (!points.is_array() || points.size() < least)
      bad(fmt::format("expected at least {} pixels [u, v] a polygon", least));
    MeshMarks::Polygon polygon;
    for (Json const& point : points) {
      if (!point.is_array() || point.size() != 2) bad("a pixel that is not [u, v]");
      polygon.emplace_back(json_finite(point[0], where, path), json_finite(point[1], where, path));
    }
    polygons.push_back(std::move(polygon));
  }
  return polygons;
}

/// Even-odd rule.
bool is_inside(MeshMarks::Polygon const& polygon, Eigen::Vector2d const& p) {
  bool inside = false;
  for (std::size_t i = 0, j = polygon.size() - 1; i < polygon.size(); j = i++) {
    Eigen::Vector2d const &a = polygon[i], &b = polygon[j];
    if ((a.y() > p.y()) == (b.y() > p.y())) continue;
    if (p.x() < a.x() + (p.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) inside = !inside;
  }
  return inside;
}

bool is_inside_any(std::vector<MeshMarks::Polygon> const& polygons, Eigen::Vector2d const& p) {
  return std::any_of(polygons.begin(), polygons.end(), [&](auto const& polygon) { return is_inside(polygon, p); });
}

}  // namespace

std::map<std::string, MeshMarks> mesh_marks_from_json(Json const& json, std::filesystem::path const& path) {
  if (!json.is_object()) throw Error(ErrorCode::bad_input, path, "expected {\"VIEW\": {...}, ...}");
  std::map<std::string, MeshMarks> result;
  for (auto const& [name, view] : json.items()) {
    refuse_unknown_keys(view, {"keep", "remove", "cut"}, name, path);
    MeshMarks& marks = result[name];
    if (view.contains("keep")) marks.keep = read_polygons(view["keep"], 3, name + ".keep", path);
    if (view.contains("remove")) marks.remove = read_polygons(view["remove"], 3, name + ".remove", path);
    if (view.contains("cut")) marks.cut = read_polygons(view["cut"], 2, name + ".cut", path);
  }
  return result;
}

void apply_polygons(MeshMarks const& marks, RangeImage& image) {
  if (marks.keep.empty() && marks.remove.empty()) return;
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x) {
      if (!image.has_depth(x, y)) continue;
      Eigen::Vector2d const p(x, y);
      bool const kept = marks.keep.empty() || is_inside_any(marks.keep, p);
      if (!kept || is_inside_any(marks.remove, p)) image.remove(x, y, PixelClass::cut);
    }
}

void apply_cuts(MeshMarks const& marks, SurfaceLinks& links) {
  int const width = links.object.cols, height = links.object.rows;
  auto const part = [&](double x, double y, bool across_columns) {
    int const left = int(std::floor(x)), top = int(std::floor(y));
    if (across_columns && left >= 0 && left + 1 < width && top >= 0 && top < height) links.right(top, left) = 0;
    if (!across_columns && left >= 0 && left < width && top >= 0 && top + 1 < height) links.down(top, left) = 0;
  };
  for (MeshMarks::Polygon const& line : marks.cut)
    for (std::size_t i = 0; i + 1 < line.size(); ++i) {
      Eigen::Vector2d const a = line[i], b = line[i + 1];
      // Where the piece crosses rows of pixel centres it passes between two columns, and the other way round.
      auto const limits = [](double from, double to, int size) {
        return std::pair(std::max(0, int(std::ceil(std::min(from, to)))),
                         std::min(size - 1, int(std::ceil(std::max(from, to))) - 1));
      };
      auto const [first_row, last_row] = limits(a.y(), b.y(), height);
      for (int y = first_row; y <= last_row; ++y)
        part(a.x() + (y - a.y()) / (b.y() - a.y()) * (b.x() - a.x()), y, true);
      auto const [first_column, last_column] = limits(a.x(), b.x(), width);
      for (int x = first_column; x <= last_column; ++x)
        part(x, a.y() + (x - a.x()) / (b.x() - a.x()) * (b.y() - a.y()), false);
    }
}

}  // namespace scanview
