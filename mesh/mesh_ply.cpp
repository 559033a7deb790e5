#include "mesh/mesh_ply.h"

#include <array>
#include <cmath>
#include <utility>

#include "mesh/mesh_builder.h"

namespace scanview {
namespace {

PlyProperty const* find_list(PlyElement const& element) {
  for (char const* name : {"vertex_indices", "vertex_index"}) {
    PlyProperty const* const property = element.find(name);
    if (property && property->is_list) return property;
  }
  return nullptr;
}

/// Vertices in a row, each with the two before it a triangle, turned every other time; −1 starts anew.
void add_strips(MeshBuilder& builder, PlyProperty const& strips) {
  for (std::size_t row = 0; row + 1 < strips.offsets.size(); ++row) {
    std::size_t start = strips.offsets[row];
    for (std::size_t k = start; k < strips.offsets[row + 1]; ++k) {
      if (strips.values[k] == -1) {
        start = k + 1;
        continue;
      }
      if (k < start + 2) continue;
      auto a = std::int64_t(strips.values[k - 2]), b = std::int64_t(strips.values[k - 1]);
      auto const c = std::int64_t(strips.values[k]);
      if ((k - start) % 2 == 1) std::swap(a, b);
      if (a != b && b != c && c != a) builder.add_triangle(a, b, c);  // strips are joined by doubled vertices
    }
  }
}

}  // namespace

TriangleMesh mesh_from_ply(PlyFile const& ply, std::filesystem::path const& path) {
  MeshBuilder builder(path);
  PlyElement const* const vertices = ply.find("vertex");
  if (!vertices) builder.fail("no element 'vertex'");
  std::array<PlyProperty const*, 3> position{}, color{};
  constexpr char const* position_names[] = {"x", "y", "z"};
  constexpr char const* color_names[] = {"blue", "green", "red"};
  bool has_color = true;
  for (int i = 0; i < 3; ++i) {
    position[i] = vertices->find(position_names[i]);
    if (!position[i] || position[i]->is_list) builder.fail(fmt::format("vertices without '{}'", position_names[i]));
    color[i] = vertices->find(color_names[i]);
    has_color = has_color && color[i] && !color[i]->is_list && color[i]->type == PlyType::uint8;
  }
  for (std::size_t row = 0; row < vertices->rows; ++row) {
    builder.add_vertex(position[0]->values[row], position[1]->values[row], position[2]->values[row]);
    if (has_color)
      builder.add_color(
          cv::Vec3b(uchar(color[0]->values[row]), uchar(color[1]->values[row]), uchar(color[2]->values[row])));
  }
  if (PlyElement const* const faces = ply.find("face"); faces && faces->rows > 0) {
    PlyProperty const* const lists = find_list(*faces);
    if (!lists) builder.fail("faces without a list 'vertex_indices'");
    std::vector<std::int64_t> polygon;
    for (std::size_t row = 0; row < faces->rows; ++row) {
      polygon.clear();
      for (std::size_t k = lists->offsets[row]; k < lists->offsets[row + 1]; ++k) {
        if (!(std::abs(lists->values[k]) < 1e18)) builder.fail("a face with an index that is no number");
        polygon.push_back(std::int64_t(lists->values[k]));
      }
      builder.add_polygon(polygon);
    }
  }
  if (PlyElement const* const strips = ply.find("tristrips"); strips && strips->rows > 0) {
    PlyProperty const* const lists = find_list(*strips);
    if (!lists) builder.fail("tristrips without a list 'vertex_indices'");
    for (double const value : lists->values)
      if (!(std::abs(value) < 1e18)) builder.fail("a strip with an index that is no number");
    add_strips(builder, *lists);
  }
  return builder.take();
}

PlyFile ply_from_mesh(TriangleMesh const& mesh) {
  PlyFile ply;
  PlyElement vertices{"vertex", mesh.vertices.size(), {}};
  constexpr char const* position_names[] = {"x", "y", "z"};
  constexpr char const* color_names[] = {"red", "green", "blue"};
  for (int i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (Eigen::Vector3f const& vertex : mesh.vertices) values.push_back(vertex[i]);
    vertices.properties.push_back(ply_scalar(position_names[i], PlyType::float32, std::move(values)));
  }
  for (int i = 0; i < 3 && !mesh.colors.empty(); ++i) {
    std::vector<double> values;
    for (cv::Vec3b const& color : mesh.colors) values.push_back(color[2 - i]);
    vertices.properties.push_back(ply_scalar(color_names[i], PlyType::uint8, std::move(values)));
  }
  PlyElement faces{"face", mesh.triangles.size(), {}};
  PlyProperty indices;
  indices.name = "vertex_indices";
  indices.type = PlyType::int32;
  indices.is_list = true;
  indices.count_type = PlyType::uint8;
  indices.offsets.push_back(0);
  for (Eigen::Vector3i const& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) indices.values.push_back(triangle[i]);
    indices.offsets.push_back(indices.values.size());
  }
  faces.properties.push_back(std::move(indices));
  ply.elements.push_back(std::move(vertices));
  ply.elements.push_back(std::move(faces));
  return ply;
}

}  // namespace scanview
