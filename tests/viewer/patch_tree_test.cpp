#include "viewer/visibility/patch_tree.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <limits>
#include <numeric>
#include <set>

#include "viewer/visibility/patch_choice.h"
#include "visibility_models.h"

namespace scanview {
namespace {

using Group = std::vector<std::uint32_t>;

std::set<std::set<std::uint32_t>> as_sets(Patches const& patches) {
  std::set<std::set<std::uint32_t>> sets;
  for (std::size_t p = 0; p < patches.count(); ++p)
    sets.insert({patches.triangles.begin() + patches.begins[p], patches.triangles.begin() + patches.begins[p + 1]});
  return sets;
}

/// The paper's words, step by step.
std::set<std::set<std::uint32_t>> fused_by_hand(TriangleMesh const& mesh, std::size_t count) {
  std::vector<std::set<std::uint32_t>> patches;
  for (std::uint32_t i = 0; i < mesh.triangles.size(); ++i) patches.push_back({i});
  auto const area = [&](std::set<std::uint32_t> const& patch) {
    double sum = 0;
    for (std::uint32_t const t : patch) {
      auto const c = [&](int k) {
        return mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][k])].cast<double>().eval();
      };
      sum += 0.5 * (c(1) - c(0)).cross(c(2) - c(0)).norm();
    }
    return sum;
  };
  auto const diagonal = [&](std::set<std::uint32_t> const& a, std::set<std::uint32_t> const& b) {
    Eigen::AlignedBox3f box;
    for (auto const* patch : {&a, &b}) {
      for (std::uint32_t const t : *patch) {
        for (int k = 0; k < 3; ++k) box.extend(mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][k])]);
      }
    }
    return box.diagonal().squaredNorm();
  };
  auto const are_neighbors = [&](std::set<std::uint32_t> const& a, std::set<std::uint32_t> const& b) {
    for (std::uint32_t const s : a) {
      for (std::uint32_t const t : b) {
        int shared = 0;
        for (int i = 0; i < 3; ++i) {
          for (int j = 0; j < 3; ++j) shared += mesh.triangles[s][i] == mesh.triangles[t][j] ? 1 : 0;
        }
        if (shared >= 2) return true;
      }
    }
    return false;
  };
  while (patches.size() > count) {
    std::size_t smallest = 0;
    for (std::size_t i = 1; i < patches.size(); ++i) {
      if (area(patches[i]) < area(patches[smallest])) smallest = i;
    }
    std::size_t best = patches.size();
    float least = std::numeric_limits<float>::infinity();
    for (std::size_t i = 0; i < patches.size(); ++i) {
      if (i == smallest || !are_neighbors(patches[smallest], patches[i])) continue;
      if (float const d = diagonal(patches[smallest], patches[i]); d < least) {
        least = d;
        best = i;
      }
    }
    if (best == patches.size()) break;
    patches[best].insert(patches[smallest].begin(), patches[smallest].end());
    patches.erase(patches.begin() + static_cast<std::ptrdiff_t>(smallest));
  }
  return {patches.begin(), patches.end()};
}

TEST(PatchTree, FusesTheSmallestWithTheNeighbourOfLeastDiagonal) {
  TriangleMesh mesh;  // an ellipsoid without symmetry, so that nothing is decided by order
  test::add_sphere(mesh, {0, 0, 0}, 1, 2);
  for (auto& v : mesh.vertices)
    v = Eigen::Vector3f(1.7F * v.x() + 0.1F * v.y() * v.y(), 0.9F * v.y(), v.z() + 0.2F * v.x());
  PatchTree const tree(mesh);
  for (std::size_t count : {100, 40, 9, 1}) EXPECT_EQ(as_sets(tree.cut(count)), fused_by_hand(mesh, count)) << count;
}

TEST(PatchTree, EachTriangleIsInOnePatchAndFinerCutsRefineCoarserOnes) {
  TriangleMesh const mesh = test::body().mesh;
  PatchTree const tree(mesh);
  Patches const fine = tree.cut(400), coarse = tree.cut(50);
  EXPECT_EQ(fine.count(), 400);
  EXPECT_EQ(coarse.count(), 50);
  EXPECT_EQ(fine.triangles, coarse.triangles) << "the order of drawing is that of the tree";
  auto sorted = fine.triangles;
  std::sort(sorted.begin(), sorted.end());
  for (std::uint32_t i = 0; i < sorted.size(); ++i) ASSERT_EQ(sorted[i], i);
  for (std::uint32_t const begin : coarse.begins)
    EXPECT_TRUE(std::binary_search(fine.begins.begin(), fine.begins.end(), begin));
}

TEST(PatchTree, DisconnectedPartsNeverFuse) {
  TriangleMesh const mesh = test::body().mesh;  // three balls; the box has six faces that share no vertices
  PatchTree const tree(mesh);
  EXPECT_EQ(tree.part_count(), 9);
  EXPECT_EQ(tree.cut(1).count(), 9);
}

TEST(PatchTree, TrianglesAtATJunctionAreNoNeighbours) {
  TriangleMesh mesh;  // the long edge below meets two short ones above, in a vertex of theirs alone
  mesh.vertices = {{0, 0, 0}, {2, 0, 0}, {1, -1, 0}, {1, 0, 0}, {0, 1, 0}, {2, 1, 0}};
  mesh.triangles = {{0, 2, 1}, {0, 3, 4}, {3, 1, 5}};
  EXPECT_EQ(PatchTree(mesh).part_count(), 3);
}

TEST(PatchTree, AllTrianglesOfANonManifoldEdgeCanFuse) {
  TriangleMesh mesh;  // a book of five pages
  mesh.vertices = {{0, 0, 0}, {0, 0, 1}};
  for (int i = 0; i < 5; ++i) {
    mesh.vertices.emplace_back(std::cos(static_cast<float>(i)), std::sin(static_cast<float>(i)), 0.5F);
    mesh.triangles.emplace_back(0, 1, 2 + i);
  }
  EXPECT_EQ(PatchTree(mesh).part_count(), 1);
  EXPECT_EQ(PatchTree(mesh).cut(2).count(), 2);
}

TEST(PatchTree, DuplicateAndZeroAreaTrianglesFuseFirst) {
  TriangleMesh mesh;
  test::add_rectangle(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 3);
  mesh.triangles.push_back(mesh.triangles[4]);  // a twin
  mesh.triangles.emplace_back(0, 1, 1);         // no area
  mesh.triangles.emplace_back(5, 5, 5);         // no edge either: a part of its own
  PatchTree const tree(mesh);
  EXPECT_EQ(tree.part_count(), 2);
  EXPECT_EQ(tree.cut(3).triangles.size(), mesh.triangles.size());
}

TEST(PatchTree, PolygonsOfManySidesStayWhole) {
  TriangleMesh mesh;
  test::add_rectangle(mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 4);
  std::vector<std::int32_t> squares(mesh.triangles.size());
  for (std::size_t i = 0; i < squares.size(); ++i) squares[i] = static_cast<std::int32_t>(i / 2);
  PatchTree const tree(mesh, squares);
  EXPECT_EQ(tree.polygon_count(), 16);
  for (std::size_t count : {16, 7, 2}) {
    Patches const patches = tree.cut(count);
    for (std::uint32_t const begin : patches.begins) EXPECT_EQ(begin % 2, 0);
    for (std::size_t i = 0; i < patches.triangles.size(); i += 2)
      EXPECT_EQ(patches.triangles[i] / 2, patches.triangles[i + 1] / 2);
  }
}

TEST(PatchTree, OneTriangleAndNoneHaveATree) {
  TriangleMesh mesh;
  EXPECT_EQ(PatchTree(mesh).cut(5).count(), 0);
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  EXPECT_EQ(PatchTree(mesh).cut(5).count(), 1);
}

TEST(PatchChoice, KeepsApartWhatWouldCostMost) {
  // Four fine patches, (0 1) and (2 3), then both: to fuse 0 and 1 costs nothing, 2 and 3 ten.
  PatchHierarchy hierarchy;
  hierarchy.fine.triangles = {0, 1, 2, 3};
  hierarchy.fine.begins = {0, 1, 2, 3, 4};
  hierarchy.fusions = {{2, 3}, {0, 1}, {4, 5}};
  std::vector<std::uint64_t> const cost{5, 5, 5, 5, 20, 10, 100};
  EXPECT_EQ(choose_patches(hierarchy, cost, 3), (Group{0, 2, 3, 4}));
  EXPECT_EQ(choose_patches(hierarchy, cost, 2), (Group{0, 2, 4}));
  EXPECT_EQ(choose_patches(hierarchy, cost, 1), (Group{0, 4}));
}

}  // namespace
}  // namespace scanview
