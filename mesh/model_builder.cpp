#include "mesh/model_builder.h"

#include <array>

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

void ModelBuilder::add_polygon(std::span<std::int64_t const> corners, Light light) {
  if (corners.size() < 3) fail(fmt::format("a face of {} vertices", corners.size()));
  for (std::int64_t const corner : corners)
    if (corner < 0 || corner >= std::int64_t(vertex_count()))
      fail(fmt::format("a face names vertex {}, but there are {}", corner, vertex_count()));
  static std::array<Eigen::Vector3i, 1> const kAlone = {Eigen::Vector3i(0, 1, 2)};
  if (corners.size() == 3) return add_triangles(corners, kAlone, light);
  std::vector<Eigen::Vector3d> points;
  for (std::int64_t const corner : corners) points.push_back(model_.mesh.vertices[corner].cast<double>());
  add_triangles(corners, triangulate_polygon(points), light);
}

void ModelBuilder::add_strip(std::span<std::int64_t const> corners, Light light) {
  for (std::size_t k = 2; k < corners.size(); ++k) {
    std::array<std::int64_t, 3> triangle = {corners[k - 2], corners[k - 1], corners[k]};
    auto const& [a, b, c] = triangle;
    if (a == b || b == c || c == a) continue;
    if (k % 2 == 1) std::swap(triangle[0], triangle[1]);
    add_polygon(triangle, light);
  }
}

void ModelBuilder::turn_from(std::size_t first_triangle) {
  for (std::size_t t = first_triangle; t < triangle_count(); ++t)
    std::swap(model_.mesh.triangles[t][1], model_.mesh.triangles[t][2]);
}

PolygonModel ModelBuilder::take() {
  if (vertex_count() > std::size_t(INT32_MAX)) fail("more vertices than 2^31");
  if (model_.mesh.colors.size() != vertex_count()) model_.mesh.colors.clear();
  return std::move(model_);
}

}  // namespace scanview
