#pragma once
#include <Eigen/Geometry>

#include "mesh/triangle_mesh.h"
#include "tests/synth/shapes.h"

namespace scanview {

/// Adds a solid block, outward.
inline void add_block(TriangleMesh& mesh, Eigen::Vector3d const& low, Eigen::Vector3d const& high) {
  int const first = static_cast<int>(mesh.vertices.size());
  TriangleMesh const cube = make_cube();
  Eigen::Vector3d const middle = 0.5 * (low + high), half = 0.5 * (high - low);
  for (auto const& v : cube.vertices)
    mesh.vertices.push_back((middle + half.cwiseProduct(v.cast<double>())).cast<float>());
  for (auto const& t : cube.triangles) mesh.triangles.push_back(t + Eigen::Vector3i::Constant(first));
}

/// A row of rooms of 6 x 6 x 3 m along x, floor at y = 0, of solid blocks: walls 0.2 m thick, doorways 1 m wide and 2.2
/// m high in the middle of the walls between. Room i has its middle at (6.2 i, ., 0).
inline TriangleMesh make_rooms(int rooms) {
  TriangleMesh mesh;
  double const left = -3.2, right = 6.2 * (rooms - 1) + 3.2;
  add_block(mesh, {left, -0.2, -3.2}, {right, 0, 3.2});
  add_block(mesh, {left, 3, -3.2}, {right, 3.2, 3.2});
  add_block(mesh, {left, 0, -3.2}, {right, 3, -3});
  add_block(mesh, {left, 0, 3}, {right, 3, 3.2});
  for (double const x : {left, right - 0.2}) add_block(mesh, {x, 0, -3}, {x + 0.2, 3, 3});
  for (int i = 0; i + 1 < rooms; ++i) {
    double const x = 6.2 * i + 3;
    add_block(mesh, {x, 0, -3}, {x + 0.2, 3, -0.5});
    add_block(mesh, {x, 0, 0.5}, {x + 0.2, 3, 3});
    add_block(mesh, {x, 2.2, -0.5}, {x + 0.2, 3, 0.5});
  }
  return mesh;
}

/// A column of the rooms' height, 0.6 m square, about a place of the floor.
inline void add_column(TriangleMesh& mesh, double x, double z) {
  add_block(mesh, {x - 0.3, 0, z - 0.3}, {x + 0.3, 3, z + 0.3});
}

}  // namespace scanview
