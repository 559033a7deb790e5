#include "viewer/visibility/feature_lines.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>
#include <set>
#include <utility>

#include "base/error.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
using Lines = std::set<std::pair<int, int>>;

/// A cube of edge 2 about a point; vertex k has bit 0, 1, 2 of k in x, y, z.
void add_cube(TriangleMesh& mesh, Eigen::Vector3f const& center) {
  int const base = static_cast<int>(mesh.vertices.size());
  for (int k = 0; k < 8; ++k) {
    mesh.vertices.push_back(center + Eigen::Vector3f(static_cast<float>(2 * (k & 1) - 1),
                                                     static_cast<float>((k & 2) - 1),
                                                     static_cast<float>((k & 4) / 2 - 1)));
  }
  constexpr int kSides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
  for (auto const& side : kSides) {
    mesh.triangles.emplace_back(base + side[0], base + side[1], base + side[2]);
    mesh.triangles.emplace_back(base + side[0], base + side[2], base + side[3]);
  }
}

TriangleMesh cube() {
  TriangleMesh mesh;
  add_cube(mesh, Eigen::Vector3f::Zero());
  return mesh;
}

TriangleMesh square() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return mesh;
}

std::vector<IndexRange> all(TriangleMesh const& mesh) {
  return {{0, static_cast<std::uint32_t>(mesh.triangles.size())}};
}

/// Ends in ascending order; fails where a line comes twice.
Lines lines_of(FeatureLines const& features, Vector3d const& eye, std::vector<IndexRange> const& ranges) {
  Lines lines;
  for (auto const& line : features.lines(eye, ranges))
    EXPECT_TRUE(lines.emplace(line.minCoeff(), line.maxCoeff()).second) << line.transpose();
  return lines;
}

constexpr double kHalfRight = std::numbers::pi / 4;

TEST(FeatureLines, TheCreasesOfACubeAreItsTwelveEdges) {
  FeatureLines const features(cube(), kHalfRight);
  EXPECT_EQ(features.edges(), 18U);
  Lines const lines = lines_of(features, {5, 6, 7}, all(cube()));
  EXPECT_EQ(lines.size(), 12U);
  for (auto const& [a, b] : lines) EXPECT_TRUE((a ^ b) == 1 || (a ^ b) == 2 || (a ^ b) == 4) << a << " " << b;
}

TEST(FeatureLines, TheSilhouetteOfACubeIsAHexagonOrASquare) {
  // No crease is as sharp as half a turn.
  FeatureLines const features(cube(), std::numbers::pi);
  EXPECT_EQ(lines_of(features, {5, 6, 7}, all(cube())), (Lines{{1, 3}, {2, 3}, {2, 6}, {4, 6}, {4, 5}, {1, 5}}));
  EXPECT_EQ(lines_of(features, {0, 0, 5}, all(cube())), (Lines{{4, 5}, {5, 7}, {6, 7}, {4, 6}}));
  // From within, all sides turn their back.
  EXPECT_TRUE(lines_of(features, {0.1, 0.2, 0.3}, all(cube())).empty());
}

TEST(FeatureLines, AnOpenSquareHasItsRimFromEverywhere) {
  FeatureLines const features(square(), kHalfRight);
  Lines const rim{{0, 1}, {1, 2}, {2, 3}, {0, 3}};
  for (double const height : {2.0, -2.0, 0.0}) EXPECT_EQ(lines_of(features, {0.3, 0.4, height}, all(square())), rim);
  // The diagonal is no rim of a half: the other half is only not drawn.
  EXPECT_EQ(lines_of(features, {0, 0, 2}, {{0, 1}}), (Lines{{0, 1}, {1, 2}}));
  EXPECT_EQ(lines_of(features, {0, 0, 2}, {{1, 1}}), (Lines{{2, 3}, {0, 3}}));
}

TEST(FeatureLines, ACreaseIsSharperThanItsAngle) {
  TriangleMesh roof = square();
  roof.vertices[3] = {0, 1, 0.5F};  // folds along the diagonal
  // Normals (0, 0, 1) and that of the lifted half.
  Vector3d const lifted = Vector3d(1, 1, 0).cross(Vector3d(0, 1, 0.5)).normalized();
  double const angle = std::acos(lifted.z());
  Vector3d const above(0, 0, 9);
  EXPECT_EQ(lines_of(FeatureLines(roof, angle - 1e-3), above, all(roof)).count({0, 2}), 1U);
  EXPECT_EQ(lines_of(FeatureLines(roof, angle + 1e-3), above, all(roof)).count({0, 2}), 0U);
}

TEST(FeatureLines, OnlyLinesOfWhatIsSelectedAreThere) {
  TriangleMesh boxes = cube();
  add_cube(boxes, {0, 0, -6});  // hidden behind the first
  FeatureLines const features(boxes, kHalfRight);
  Vector3d const eye(0, 0, 9);
  EXPECT_EQ(lines_of(features, eye, all(boxes)).size(), 24U);
  Lines const first = lines_of(features, eye, {{0, 12}});
  EXPECT_EQ(first, lines_of(FeatureLines(cube(), kHalfRight), eye, all(cube())));
  // Fronts alone, in two ranges: the side towards the eye of one and of the other.
  EXPECT_EQ(lines_of(features, eye, {{2, 2}, {14, 2}}),
            (Lines{{4, 5}, {5, 7}, {6, 7}, {4, 6}, {12, 13}, {13, 15}, {14, 15}, {12, 14}}));
  EXPECT_TRUE(lines_of(features, eye, {}).empty());
}

TEST(FeatureLines, RepeatedVerticesAndMixedWindingsAreNoLines) {
  // Each triangle with vertices of its own, every third one turned.
  TriangleMesh const shared = cube();
  TriangleMesh loose;
  for (std::size_t i = 0; i < shared.triangles.size(); ++i) {
    int const base = static_cast<int>(loose.vertices.size());
    for (int k = 0; k < 3; ++k)
      loose.vertices.push_back(shared.vertices[static_cast<std::size_t>(shared.triangles[i][k])]);
    loose.triangles.emplace_back(base, base + (i % 3 == 0 ? 2 : 1), base + (i % 3 == 0 ? 1 : 2));
  }
  auto const places = [](TriangleMesh const& mesh, double crease) {
    std::set<std::vector<float>> found;
    for (auto const& line : FeatureLines(mesh, crease).lines({5, 6, 7}, all(mesh))) {
      Eigen::Vector3f const middle =
          mesh.vertices[static_cast<std::size_t>(line[0])] + mesh.vertices[static_cast<std::size_t>(line[1])];
      found.insert({middle.x(), middle.y(), middle.z()});
    }
    return found;
  };
  for (double const crease : {kHalfRight, std::numbers::pi}) EXPECT_EQ(places(loose, crease), places(shared, crease));
}

TEST(FeatureLines, DegenerateTrianglesAndEdgesOfThreeHaveAnAnswer) {
  TriangleMesh mesh = square();
  mesh.vertices.push_back({2, 0, 0});
  mesh.triangles.emplace_back(0, 1, 4);  // without area, along the lower side
  mesh.triangles.emplace_back(0, 0, 3);
  FeatureLines const features(mesh, kHalfRight);
  EXPECT_EQ(lines_of(features, {0.3, 0.4, 2}, {{0, 2}}), (Lines{{1, 2}, {2, 3}, {0, 3}}));
  // A fin on the diagonal.
  TriangleMesh fin = square();
  fin.vertices.push_back({0.5F, 0.5F, 1});
  fin.triangles.emplace_back(0, 2, 4);
  EXPECT_EQ(lines_of(FeatureLines(fin, std::numbers::pi), {0.3, 0.4, 2}, all(fin)).count({0, 2}), 1U);
  EXPECT_TRUE(FeatureLines(TriangleMesh{}, kHalfRight).lines({0, 0, 1}, {}).empty());
  EXPECT_THROW(FeatureLines(fin, -0.1), Error);
  EXPECT_THROW(FeatureLines(fin, 3.2), Error);
}

}  // namespace
}  // namespace scanview
