#include "mesh/equal_vertices.h"

#include <fmt/format.h>

#include <bit>
#include <cstdint>
#include <utility>

namespace scanview {
namespace {

std::uint64_t hash(Eigen::Vector3f const& p) {
  std::uint64_t h = 0;
  for (int i = 0; i < 3; ++i) {
    h ^= std::bit_cast<std::uint32_t>(p[i] + 0.0f);  // −0 becomes 0
    h *= 0x9e3779b97f4a7c15;
    h ^= h >> 32;
  }
  return h;
}

}  // namespace

std::vector<int> first_of_equals(std::vector<Eigen::Vector3f> const& vertices) {
  std::size_t const slots = std::bit_ceil(2 * vertices.size() + 1);
  std::vector<int> table(slots, -1), first(vertices.size());
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    std::size_t slot = hash(vertices[v]) & (slots - 1);
    while (table[slot] >= 0 && vertices[table[slot]] != vertices[v]) slot = (slot + 1) & (slots - 1);
    if (table[slot] < 0) table[slot] = int(v);
    first[v] = table[slot];
  }
  return first;
}

PolygonModel join_equal_vertices(PolygonModel model) {
  TriangleMesh& mesh = model.mesh;
  std::vector<int> number = first_of_equals(mesh.vertices);
  int count = 0;
  for (std::size_t v = 0; v < number.size(); ++v) {
    if (number[v] != int(v)) {
      number[v] = number[number[v]];  // which is smaller than v: numbered already
      continue;
    }
    mesh.vertices[count] = mesh.vertices[v];
    if (!mesh.colors.empty()) mesh.colors[count] = mesh.colors[v];
    number[v] = count++;
  }
  if (std::size_t(count) == number.size()) return model;
  model.notes.push_back(fmt::format("{} vertices were joined to {} of different positions", number.size(), count));
  mesh.vertices.resize(count);
  if (!mesh.colors.empty()) mesh.colors.resize(count);
  for (Eigen::Vector3i& triangle : mesh.triangles)
    for (int& corner : triangle) corner = number[corner];
  return model;
}

}  // namespace scanview
