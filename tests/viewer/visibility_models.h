#pragma once
#include <limits>
#include <span>
#include <vector>

#include "mesh/polygon_model.h"
#include "viewer/visibility/sample_sphere.h"
#include "viewer/visibility/visibility_selector.h"

namespace scanview::test {

/// Adds a sphere of 8 · 4^level triangles.
inline void add_sphere(TriangleMesh& mesh, Eigen::Vector3f const& center, float radius, int level) {
  SampleSphere const sphere = SampleSphere::octahedron(level);
  auto const first = static_cast<int>(mesh.vertices.size());
  for (auto const& d : sphere.directions()) mesh.vertices.push_back(center + radius * d.cast<float>());
  for (auto const& face : sphere.faces()) mesh.triangles.push_back(face + Eigen::Vector3i::Constant(first));
}

/// Adds the rectangle corner, corner + u, corner + u + v, corner + v in cells × cells squares; its front to u × v.
inline void add_rectangle(TriangleMesh& mesh, Eigen::Vector3f const& corner, Eigen::Vector3f const& u,
                          Eigen::Vector3f const& v, int cells) {
  auto const first = static_cast<int>(mesh.vertices.size());
  for (int j = 0; j <= cells; ++j) {
    for (int i = 0; i <= cells; ++i)
      mesh.vertices.push_back(corner + u * (static_cast<float>(i) / static_cast<float>(cells)) +
                              v * (static_cast<float>(j) / static_cast<float>(cells)));
  }
  for (int j = 0; j < cells; ++j) {
    for (int i = 0; i < cells; ++i) {
      int const a = first + j * (cells + 1) + i, b = a + 1, c = a + cells + 1;
      mesh.triangles.emplace_back(a, b, c + 1);
      mesh.triangles.emplace_back(a, c + 1, c);
    }
  }
}

/// A closed box with its faces outwards.
inline void add_box(TriangleMesh& mesh, Eigen::Vector3f const& low, Eigen::Vector3f const& high, int cells) {
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3f u = Eigen::Vector3f::Zero(), v = u;
    u[(axis + 1) % 3] = (high - low)[(axis + 1) % 3];
    v[(axis + 2) % 3] = (high - low)[(axis + 2) % 3];
    Eigen::Vector3f far = low;
    far[axis] = high[axis];
    add_rectangle(mesh, far, u, v, cells);
    add_rectangle(mesh, low, v, u, cells);
  }
}

/// A body with hollows: three balls that hide parts of each other, and a box.
inline PolygonModel body() {
  PolygonModel model;
  add_sphere(model.mesh, {0, 0, 0}, 1, 4);
  add_sphere(model.mesh, {1.2F, 0.3F, 0}, 0.5F, 3);
  add_sphere(model.mesh, {-0.4F, 1.1F, 0.5F}, 0.4F, 3);
  add_box(model.mesh, {0.2F, -1.6F, -0.3F}, {0.9F, -0.9F, 0.4F}, 6);
  return model;
}

inline constexpr double kInfinity = std::numeric_limits<double>::infinity();

inline VisibilityOptions quick() {
  VisibilityOptions options;
  options.samples = 258;
  options.resolution = 256;
  options.shells = {2, kInfinity};
  options.patches = 60;
  return options;
}

/// Whether the model's triangle is among the selected.
inline std::vector<bool> selected(VisibilityField const& field, std::span<IndexRange const> ranges) {
  std::vector<bool> is_drawn(field.patches.triangles.size());
  for (IndexRange const& range : ranges) {
    for (std::uint32_t i = range.first; i < range.first + range.count; ++i) is_drawn[field.patches.triangles[i]] = true;
  }
  return is_drawn;
}

}  // namespace scanview::test
