#include "mesh/material_colors.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <utility>

namespace scanview {
namespace {

class Painter {
 public:
  Painter(PolygonModel& model, MaterialColors const& materials) : model_(model), materials_(materials) {}

  bool has_colors() const {
    for (std::size_t t = 0; t < materials_.of_triangle.size(); ++t)
      if (!model_.textures.on(t) && stated(t)) return true;
    return false;
  }

  void paint_vertices() {
    std::size_t const count = model_.mesh.vertices.size();
    model_.mesh.colors.assign(count, kWhite);
    std::vector<std::uint8_t> painted(count, 0);
    for (bool const textured : {false, true})  // what shows its vertices' colours goes first
      for (std::size_t t = 0; t < model_.mesh.triangles.size(); ++t) {
        if (model_.textures.on(t) != textured) continue;
        for (int const vertex : model_.mesh.triangles[t])
          if (!std::exchange(painted[vertex], 1)) model_.mesh.colors[vertex] = color(t);
      }
  }

  void cover_mixed_triangles() {
    ModelTextures& textures = model_.textures;
    std::size_t const count = model_.mesh.triangles.size();
    std::map<std::array<uchar, 3>, std::int32_t> plain;
    for (std::size_t t = 0; t < count; ++t) {
      Eigen::Vector3i const& corners = model_.mesh.triangles[t];
      cv::Vec3b const own = color(t);
      bool const is_own =
          std::all_of(corners.begin(), corners.end(), [&](int v) { return model_.mesh.colors[v] == own; });
      if (is_own || textures.on(t)) continue;
      auto const [place, is_new] = plain.try_emplace({own[0], own[1], own[2]}, textures.textures.size());
      if (is_new) textures.textures.push_back({.picture = cv::Mat3b(1, 1, own)});
      textures.of_triangle.resize(count, -1);
      textures.corners.resize(count, kCorner);
      textures.of_triangle[t] = place->second;
    }
  }

 private:
  std::optional<cv::Vec3b> stated(std::size_t triangle) const {
    std::int32_t const material = materials_.of_triangle[triangle];
    return material < 0 ? std::nullopt : materials_.colors[material];
  }
  cv::Vec3b color(std::size_t triangle) const { return stated(triangle).value_or(kWhite); }

  inline static cv::Vec3b const kWhite{255, 255, 255};
  inline static TextureCorners const kCorner = {Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero(),
                                                Eigen::Vector2f::Zero()};

  PolygonModel& model_;
  MaterialColors const& materials_;
};

}  // namespace

PolygonModel colored_by_materials(PolygonModel model, MaterialColors const& materials) {
  Painter painter(model, materials);
  if (!model.mesh.colors.empty() || !painter.has_colors()) return model;
  painter.paint_vertices();
  painter.cover_mixed_triangles();
  return model;
}

}  // namespace scanview
