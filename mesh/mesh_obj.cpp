#include "mesh/mesh_obj.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "mesh/material_library.h"
#include "mesh/model_builder.h"
#include "mesh/words.h"

namespace scanview {
namespace {

/// The transparent materials of the libraries that a model names.
class Materials {
 public:
  Materials(std::filesystem::path const& model, ModelBuilder& builder) : model_(model), builder_(builder) {}

  void add_library(std::string_view names) {
    if (!tried_.insert(std::string(names)).second) return;
    try {
      transparent_.merge(transparent_materials(names, model_));
    } catch (Error const& error) {
      builder_.note(
          fmt::format("materials taken for opaque: {}: {}", error.path().filename().string(), error.message()));
    }
  }
  Light light(std::string_view material) const {
    return transparent_.contains(std::string(material)) ? Light::passes : Light::stops;
  }

 private:
  std::filesystem::path const& model_;
  ModelBuilder& builder_;
  std::set<std::string> tried_, transparent_;
};

/// Of the numbers of a line. (Names may hold a #.)
bool is_end(std::string_view word) { return word.empty() || word.front() == '#'; }

}  // namespace

PolygonModel model_from_obj(std::string text, std::filesystem::path const& path) {
  ModelBuilder builder(path);
  Materials materials(path, builder);
  Light light = Light::stops;
  for (std::size_t at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1)) {
    std::size_t const end = text.compare(at + 1, 2, "\r\n") == 0 ? at + 2 : at + 1;
    if (end < text.size() && text[end] == '\n') std::fill(text.begin() + at, text.begin() + end + 1, ' ');
  }
  std::vector<std::int64_t> polygon;
  Lines lines(text);
  while (auto const line = lines.next()) {
    Words words(*line);
    std::string_view const keyword = words.next();
    auto const bad = [&](char const* what) { builder.fail(fmt::format("line {}: {}", lines.number(), what)); };
    if (keyword == "v") {
      double values[6];
      int count = 0;
      for (std::string_view word = words.next(); !is_end(word) && count < 6; word = words.next()) {
        auto const value = parse_number<double>(word);
        if (!value) bad("a coordinate that is no number");
        values[count++] = *value;
      }
      if (count < 3) bad("a vertex with fewer than three coordinates");
      builder.add_vertex(values[0], values[1], values[2]);
      if (count == 6) {
        cv::Vec3b color;
        for (int c = 0; c < 3; ++c) {
          if (!(values[3 + c] >= 0 && values[3 + c] <= 1)) bad("a colour outside 0..1");
          color[2 - c] = uchar(std::lround(255 * values[3 + c]));
        }
        builder.add_color(color);
      }
    } else if (keyword == "f") {
      polygon.clear();
      for (std::string_view word = words.next(); !is_end(word); word = words.next()) {
        auto const index = parse_number<std::int64_t>(word.substr(0, std::min(word.find('/'), word.size())));
        if (!index || *index == 0) bad("a face with an index that is none");
        polygon.push_back(*index > 0 ? *index - 1 : std::int64_t(builder.vertex_count()) + *index);
      }
      builder.add_polygon(polygon, light);
    } else if (keyword == "usemtl") {
      light = materials.light(trimmed(words.rest()));
    } else if (keyword == "mtllib") {
      materials.add_library(trimmed(words.rest()));
    }
  }
  if (builder.vertex_count() == 0) builder.fail("no vertices: not a Wavefront OBJ file");
  return builder.take();
}

}  // namespace scanview
