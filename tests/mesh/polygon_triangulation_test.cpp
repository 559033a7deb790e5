#include "mesh/polygon_triangulation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <random>

namespace scanview {
namespace {

using Points = std::vector<Eigen::Vector3d>;
using Triangles = std::vector<Eigen::Vector3i>;

Eigen::Vector3d area(Points const& p, Eigen::Vector3i const& t) {
  return (p[t[1]] - p[t[0]]).cross(p[t[2]] - p[t[0]]) / 2;
}
Eigen::Vector3d area(Points const& p) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < p.size(); ++i) sum += p[i].cross(p[(i + 1) % p.size()]) / 2;
  return sum;
}

/// n − 2 triangles that turn as the polygon does and cover it once.
void expect_covered(Points const& polygon) {
  Triangles const triangles = triangulate_polygon(polygon);
  ASSERT_EQ(triangles.size(), polygon.size() - 2);
  Eigen::Vector3d const whole = area(polygon);
  double sum = 0;
  for (Eigen::Vector3i const& t : triangles) {
    double const part = area(polygon, t).dot(whole) / whole.norm();
    EXPECT_GT(part, -1e-12);
    sum += std::abs(part);
  }
  EXPECT_NEAR(sum, whole.norm(), 1e-9 * whole.norm());
}

TEST(PolygonTriangulation, ConvexPolygonsBecomeFans) {
  Points const square = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(triangulate_polygon(square), (Triangles{{0, 1, 2}, {0, 2, 3}}));
  Points const straight = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {2, 1, 0}, {0, 1, 0}};
  EXPECT_EQ(triangulate_polygon(straight), (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
}

TEST(PolygonTriangulation, AnArrowIsCutAlongItsAxis) {
  Points const arrow = {{1, 0, 0}, {-1, 1, 0}, {-0.5, 0, 0}, {-1, -1, 0}};
  expect_covered(arrow);
  for (int turn = 0; turn < 4; ++turn) {
    Points turned;
    for (int i = 0; i < 4; ++i) turned.push_back(arrow[(i + turn) % 4]);
    expect_covered(turned);
  }
}

TEST(PolygonTriangulation, StarsOfAnySideAndPlaneAreCovered) {
  constexpr unsigned kSeed = 7;
  SCOPED_TRACE(kSeed);
  std::mt19937 random(kSeed);
  std::uniform_real_distribution<double> radius(0.1, 1), any(-1, 1);
  for (int trial = 0; trial < 200; ++trial) {
    Eigen::Quaterniond const turn(Eigen::Vector4d(any(random), any(random), any(random), any(random)).normalized());
    int const count = 4 + trial % 60;
    Points star;
    for (int i = 0; i < count; ++i) {
      double const angle = (trial % 2 == 0 ? 2 : -2) * M_PI * i / count;
      star.push_back(turn * (radius(random) * Eigen::Vector3d(std::cos(angle), std::sin(angle), 0)));
    }
    expect_covered(star);
  }
}

TEST(PolygonTriangulation, CombsAndHolesAreCovered) {
  Points comb;
  for (int i = 0; i < 40; ++i) comb.emplace_back(i, i % 2 == 0 ? 10 : 0.5, 0);
  comb.emplace_back(39, 0, 0);
  comb.emplace_back(0, 0, 0);
  std::reverse(comb.begin(), comb.end());
  expect_covered(comb);
  // A square with a square hole, joined by the edge (0, 0) (1, 1) that is there twice.
  expect_covered(
      {{0, 0, 0}, {3, 0, 0}, {3, 3, 0}, {0, 3, 0}, {0, 0, 0}, {1, 1, 0}, {1, 2, 0}, {2, 2, 0}, {2, 1, 0}, {1, 1, 0}});
}

TEST(PolygonTriangulation, WhatIsNoPolygonIsAFanInLinearTime) {
  Points crossed = {{0, 0, 0}, {1, 1, 0}, {1, 0, 0}, {0, 3, 0}, {2, 2, 0}};
  EXPECT_EQ(triangulate_polygon(crossed).size(), 3u);
  EXPECT_EQ(triangulate_polygon(Points(5, Eigen::Vector3d(1, 2, 3))), (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 3, 4}}));
  std::mt19937 random(1);
  std::uniform_real_distribution<double> any(-1, 1);
  Points tangle;
  for (int i = 0; i < 20'000; ++i) tangle.emplace_back(any(random), any(random), any(random));
  EXPECT_EQ(triangulate_polygon(tangle).size(), 19'998u);
}

}  // namespace
}  // namespace scanview
