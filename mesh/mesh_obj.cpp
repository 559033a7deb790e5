#include "mesh/mesh_obj.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>

#include "mesh/material_library.h"
#include "mesh/model_builder.h"
#include "mesh/model_pictures.h"
#include "mesh/words.h"

namespace scanview {
namespace {

/// Of the numbers of a line. (Names may hold a #.)
bool is_end(std::string_view word) { return word.empty() || word.front() == '#'; }

/// The materials of the libraries that a model names.
class Materials {
 public:
  Materials(std::filesystem::path const& model, ModelBuilder& builder)
      : model_(model), builder_(builder), pictures_(builder) {}

  struct Used {
    Light light = Light::stops;
    std::int32_t number = -1;  ///< the builder's
    MaterialMap const* map = nullptr;
  };

  void add_library(std::string_view names) {
    if (!tried_.insert(std::string(names)).second) return;
    try {
      for (LibraryMaterial& material : read_material_libraries(names, model_)) {
        auto const [known, is_new] = known_.try_emplace(material.name, Known{material, std::nullopt});
        if (!is_new && material.light == Light::passes) known->second.material.light = Light::passes;
      }
    } catch (Error const& error) {
      builder_.note(
          fmt::format("materials taken for opaque: {}: {}", error.path().filename().string(), error.message()));
    }
  }
  Used use(std::string_view name) {
    auto const found = known_.find(name);
    if (found == known_.end()) return {};
    auto& [material, number] = found->second;
    auto const& map = material.map;
    if (!number) {
      cv::Mat3b const picture = map ? pictures_.beside(model_, map->file) : cv::Mat3b();
      ModelMaterial added{material.color, std::nullopt};
      if (!picture.empty()) added.texture = {.picture = picture, .wrap_u = map->wrap, .wrap_v = map->wrap};
      number = builder_.add_material(std::move(added));
      if (picture.empty()) material.map.reset();
    }
    return {material.light, *number, map ? &*map : nullptr};
  }

 private:
  struct Known {
    LibraryMaterial material;
    std::optional<std::int32_t> number;  ///< once it is used
  };

  std::filesystem::path const& model_;
  ModelBuilder& builder_;
  ModelPictures pictures_;
  std::set<std::string> tried_;
  std::map<std::string, Known, std::less<>> known_;
};

/// The `vt` of a file, v up. What is no number is kept as such, for the builder leaves out faces that name it.
class TextureCoordinates {
 public:
  /// A file without materials has no use for them.
  explicit TextureCoordinates(std::string_view text) : is_needed_(text.find("mtllib") != std::string_view::npos) {}

  void add(Words words) {
    if (!is_needed_) return;
    std::string_view const u = words.next(), v = words.next();
    at_.emplace_back(parse_number<float>(u).value_or(NAN), is_end(v) ? 0 : parse_number<float>(v).value_or(NAN));
  }
  /// Where a face's corner, "v/vt" or "v/vt/vn", lies in a picture.
  Eigen::Vector2f at(std::string_view corner, MaterialMap const& map) const {
    std::string_view const second = corner.substr(std::min(corner.find('/'), corner.size() - 1) + 1);
    auto const number = parse_number<std::int64_t>(second.substr(0, second.find('/'))).value_or(0);
    std::int64_t const index = number > 0 ? number - 1 : std::int64_t(at_.size()) + number;
    if (number == 0 || index < 0 || index >= std::int64_t(at_.size())) return Eigen::Vector2f::Constant(NAN);
    Eigen::Vector2f const up = map.scale.cwiseProduct(at_[index]) + map.offset;
    return {up.x(), 1 - up.y()};
  }

 private:
  bool is_needed_;
  std::vector<Eigen::Vector2f> at_;
};

}  // namespace

PolygonModel model_from_obj(std::string text, std::filesystem::path const& path) {
  ModelBuilder builder(path);
  Materials materials(path, builder);
  Materials::Used material;
  for (std::size_t at = text.find('\\'); at != std::string::npos; at = text.find('\\', at + 1)) {
    std::size_t const end = text.compare(at + 1, 2, "\r\n") == 0 ? at + 2 : at + 1;
    if (end < text.size() && text[end] == '\n') std::fill(text.begin() + at, text.begin() + end + 1, ' ');
  }
  TextureCoordinates coordinates(text);
  std::vector<std::int64_t> polygon;
  std::vector<Eigen::Vector2f> at;
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
      at.clear();
      for (std::string_view word = words.next(); !is_end(word); word = words.next()) {
        auto const index = parse_number<std::int64_t>(word.substr(0, std::min(word.find('/'), word.size())));
        if (!index || *index == 0) bad("a face with an index that is none");
        polygon.push_back(*index > 0 ? *index - 1 : std::int64_t(builder.vertex_count()) + *index);
        if (material.map) at.push_back(coordinates.at(word, *material.map));
      }
      builder.add_polygon(polygon, material.light, {material.number, at});
    } else if (keyword == "vt") {
      coordinates.add(words);
    } else if (keyword == "usemtl") {
      material = materials.use(trimmed(words.rest()));
    } else if (keyword == "mtllib") {
      materials.add_library(trimmed(words.rest()));
    }
  }
  if (builder.vertex_count() == 0) builder.fail("no vertices: not a Wavefront OBJ file");
  return builder.take();
}

}  // namespace scanview
