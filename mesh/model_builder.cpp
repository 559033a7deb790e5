#include "mesh/model_builder.h"

#include <algorithm>
#include <array>

#include "mesh/equal_vertices.h"
#include "mesh/polygon_triangulation.h"

namespace scanview {

void ModelBuilder::add_triangles(std::span<std::int64_t const> corners, std::span<Eigen::Vector3i const> triangles,
                                 Light light) {
  for (std::int64_t const corner : corners)
    if (!passes_.empty() && passes_[corner]) light = Light::passes;
  std::size_t const before = triangle_count();
  for (Eigen::Vector3i const& t : triangles)
    model_.mesh.triangles.emplace_back(int(corners[t[0]]), int(corners[t[1]]), int(corners[t[2]]));
  if (triangle_count() > std::size_t(INT32_MAX)) fail("more triangles than 2^31");
  // Neither list is begun before it says anything.
  if (triangles.size() != 1 || !model_.polygons.empty()) {
    for (std::size_t i = model_.polygons.size(); i < before; ++i) model_.polygons.push_back(std::int32_t(i));
    model_.polygons.resize(triangle_count(), polygon_count_);
  }
  if (light == Light::passes || !model_.transparent.empty()) {
    model_.transparent.resize(before, 0);
    model_.transparent.resize(triangle_count(), light == Light::passes);
  }
  ++polygon_count_;
}

std::int32_t ModelBuilder::add_material(ModelMaterial material) {
  colors_.colors.push_back(material.color);
  textures_.push_back(material.texture ? std::int32_t(model_.textures.textures.size()) : -1);
  if (material.texture) model_.textures.textures.push_back(*std::move(material.texture));
  return std::int32_t(textures_.size()) - 1;
}

std::int32_t ModelBuilder::texture_of(PolygonPaint const& paint, std::size_t corner_count) {
  std::int32_t const texture = paint.material < 0 ? -1 : textures_[paint.material];
  if (texture < 0) return -1;
  bool const is_placed = paint.at.size() == corner_count &&
                         std::all_of(paint.at.begin(), paint.at.end(), [](auto const& at) { return at.allFinite(); });
  if (!is_placed) ++unplaced_;
  return is_placed ? texture : -1;
}

void ModelBuilder::paint_triangles(std::size_t first_triangle, std::span<Eigen::Vector3i const> triangles,
                                   std::size_t corner_count, PolygonPaint const& paint) {
  if (paint.material >= 0 || !colors_.of_triangle.empty()) {
    colors_.of_triangle.resize(first_triangle, -1);
    colors_.of_triangle.resize(triangle_count(), paint.material);
  }
  std::int32_t const texture = texture_of(paint, corner_count);
  ModelTextures& textures = model_.textures;
  if (texture < 0 && textures.of_triangle.empty()) return;
  static TextureCorners const kNowhere = {Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero(), Eigen::Vector2f::Zero()};
  textures.of_triangle.resize(first_triangle, -1);
  textures.of_triangle.resize(triangle_count(), texture);
  textures.corners.resize(first_triangle, kNowhere);
  for (Eigen::Vector3i const& t : triangles)
    textures.corners.push_back(texture < 0 ? kNowhere : TextureCorners{paint.at[t[0]], paint.at[t[1]], paint.at[t[2]]});
}

void ModelBuilder::add_polygon(std::span<std::int64_t const> corners, Light light, PolygonPaint const& paint) {
  if (corners.size() < 3) fail(fmt::format("a face of {} vertices", corners.size()));
  for (std::int64_t const corner : corners)
    if (corner < 0 || corner >= std::int64_t(vertex_count()))
      fail(fmt::format("a face names vertex {}, but there are {}", corner, vertex_count()));
  std::size_t const before = triangle_count();
  auto const add = [&](std::span<Eigen::Vector3i const> triangles) {
    add_triangles(corners, triangles, light);
    paint_triangles(before, triangles, corners.size(), paint);
  };
  static std::array<Eigen::Vector3i, 1> const kAlone = {Eigen::Vector3i(0, 1, 2)};
  if (corners.size() == 3) return add(kAlone);
  std::vector<Eigen::Vector3d> points;
  for (std::int64_t const corner : corners) points.push_back(model_.mesh.vertices[corner].cast<double>());
  add(triangulate_polygon(points));
}

void ModelBuilder::add_triangle(std::span<std::int64_t const> list, std::array<std::size_t, 3> const& from, Light light,
                                PolygonPaint const& paint) {
  std::array const corners = {list[from[0]], list[from[1]], list[from[2]]};
  if (paint.at.size() != list.size()) return add_polygon(corners, light, {.material = paint.material});
  add_polygon(corners, light,
              {paint.material, TextureCorners{paint.at[from[0]], paint.at[from[1]], paint.at[from[2]]}});
}

void ModelBuilder::add_strip(std::span<std::int64_t const> corners, Light light, PolygonPaint const& paint) {
  for (std::size_t k = 2; k < corners.size(); ++k) {
    std::int64_t const a = corners[k - 2], b = corners[k - 1], c = corners[k];
    if (a == b || b == c || c == a) continue;
    std::array<std::size_t, 3> from = {k - 2, k - 1, k};
    if (k % 2 == 1) std::swap(from[0], from[1]);
    add_triangle(corners, from, light, paint);
  }
}

void ModelBuilder::turn_from(std::size_t first_triangle) {
  for (std::size_t t = first_triangle; t < triangle_count(); ++t)
    std::swap(model_.mesh.triangles[t][1], model_.mesh.triangles[t][2]);
  model_.textures.turn_from(first_triangle);
}

PolygonModel ModelBuilder::take() { return colored_by_materials(finished(), colors_); }

PolygonModel ModelBuilder::take_joined() { return colored_by_materials(join_equal_vertices(finished()), colors_); }

PolygonModel ModelBuilder::finished() {
  if (vertex_count() > std::size_t(INT32_MAX)) fail("more vertices than 2^31");
  if (model_.mesh.colors.size() != vertex_count()) model_.mesh.colors.clear();
  if (model_.textures.of_triangle.empty()) model_.textures = {};
  if (unplaced_ > 0)
    note(fmt::format("{} polygons have no sound texture coordinates: left without texture", unplaced_));
  return std::move(model_);
}

}  // namespace scanview
