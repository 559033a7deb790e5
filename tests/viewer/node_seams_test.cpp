#include "mesh/node_seams.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "viewer/rooms.h"

namespace scanview::test {
namespace {

using Eigen::Vector3d;

/// Edges of the mesh that have a triangle on one side only.
std::size_t open_edges(NodeMesh const& mesh) {
  std::map<std::pair<int, int>, int> count;
  for (Eigen::Vector3i const& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) {
      auto const [a, b] = std::minmax({t[i], t[(i + 1) % 3]});
      ++count[{a, b}];
    }
  return std::size_t(std::count_if(count.begin(), count.end(), [](auto const& edge) { return edge.second != 2; }));
}

/// By side, the vertices on the edge of the cube between the sides towards `a` and `b` (unit vectors).
std::array<std::set<std::array<float, 3>>, 2> on_edge(NodeMesh const& mesh, Vector3d const& a, Vector3d const& b) {
  std::array<std::set<std::array<float, 3>>, 2> found;
  for (NodeMesh::Side const& side : mesh.sides)
    for (int which = 0; which < 2; ++which) {
      if (side.node_from_camera.col(2).dot(which == 0 ? a : b) < 0.9) continue;
      for (std::size_t t = side.first; t < side.end; ++t)
        for (int const v : mesh.triangles[t]) {
          Vector3d const p = mesh.vertices[v].cast<double>();
          if (p.dot(a) > 0 && std::abs(p.dot(a) - p.dot(b)) <= 1e-5 * p.norm())
            found[which].insert({mesh.vertices[v].x(), mesh.vertices[v].y(), mesh.vertices[v].z()});
        }
    }
  return found;
}

TEST(NodeSeams, AClosedRoomIsAClosedSurface) {
  Vector3d const where(0.2, -0.1, 0.3);
  for (Surface const& scene : {room(2, plain({0.5, 0.5, 0.5})), inside_of(slanted_walls(), plain({0.5, 0.5, 0.5})),
                               globe({0.3, -0.2, 0.4}, 2, plain({0.5, 0.5, 0.5}))})
    for (int const most : {60, 300, 0})
      for (auto const fit : {NodeMeshOptions::Fit::none, NodeMeshOptions::Fit::joint}) {
        NodeMeshOptions options;
        options.max_triangles = most;
        options.fit = fit;
        EXPECT_EQ(open_edges(mesh_of(capture_cube(scene, where, 48), options)), 0U) << most;
      }
}

TEST(NodeSeams, AColumnThatCrossesAnEdgeOfTheCubeIsOneOnBothSides) {
  // Before the edge between the sides towards +x and +z, narrower towards one of them.
  Surface const scene =
      together({room(3, plain({0.5, 0.5, 0.5})), solid_box({0.9, -0.4, 0.7}, {1.3, 0.5, 1.2}, plain({0.8, 0.1, 0.1}))});
  NodeMesh const mesh = mesh_of(capture_cube(scene, Vector3d::Zero(), 64));
  auto const [x, z] = on_edge(mesh, Vector3d::UnitX(), Vector3d::UnitZ());
  auto const is_column = [](std::array<float, 3> const& v) { return v[0] < 2; };
  auto const is_wall = [](std::array<float, 3> const& v) { return v[0] > 2.9; };
  EXPECT_GE(std::count_if(x.begin(), x.end(), is_column), 2);
  for (auto const& v : x) EXPECT_TRUE(is_column(v) || is_wall(v)) << v[0] << ' ' << v[1] << ' ' << v[2];
  // The column's front (x = 0.9) and the room's corner lie on the edge: both sides see one surface all along it.
  EXPECT_EQ(x, z);
}

TEST(NodeSeams, EdgesOfTheCubeAreNoSilhouettes) {
  NodeMesh const mesh = mesh_of(capture_cube(globe({0.3, -0.2, 0.4}, 2, plain({1, 1, 1})), Vector3d::Zero(), 48));
  for (NodeMesh::Side const& side : mesh.sides)
    for (uchar const weight : side.feather) ASSERT_EQ(weight, 255);
  // But that of a picture beside which there is no other is one.
  CapturedNode alone = capture_cube(globe({0, 0, 0}, 2, plain({1, 1, 1})), Vector3d::Zero(), 48);
  alone.sides.resize(1);
  NodeMesh const side = mesh_of(alone);
  EXPECT_LT(side.sides[0].feather(0, 24), 10);
  EXPECT_EQ(side.sides[0].feather(24, 24), 255);
}

TEST(NodeSeams, SidesOfACubeAgreeInItsEdgesAndCorners) {
  std::map<std::array<long, 3>, int> keys;
  int const size = 8;
  for (int side = 0; side < kCubeSides; ++side)
    for (int x = 0; x <= size; ++x)
      for (int y = 0; y <= size; ++y) {
        if (x != 0 && x != size && y != 0 && y != size) continue;
        ++keys[seam_key(cube_side_camera(size), scene_from_cube_side(side, Vector3d::Zero()).linear(),
                        {x - 0.5, y - 0.5})];
      }
  // Eight corners of three sides, twelve edges of two.
  EXPECT_EQ(keys.size(), std::size_t(8 + 12 * (size - 1)));
  for (auto const& [key, count] : keys) {
    int extreme = 0;
    for (long const c : key) extreme += std::abs(c) == 1L << 24;
    EXPECT_EQ(count, extreme);
  }
}

}  // namespace
}  // namespace scanview::test
