#include "synth/scene_sight.h"

#include <gtest/gtest.h>

#include <bit>

#include "base/random.h"
#include "tests/expect_error.h"
#include "tests/synth/rooms.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

TEST(SceneSight, DistanceIsToTheNearestSurfaceAndCapped) {
  TriangleMesh mesh;
  add_block(mesh, {-1, -1, -1}, {1, 1, 1});
  SceneSight const scene(mesh, SceneWinding::trusted);
  CounterRandom random(7, 0);
  for (int i = 0; i < 1000; ++i) {
    Vector3d const p(6 * random.uniform() - 3, 6 * random.uniform() - 3, 6 * random.uniform() - 3);
    Vector3d const out = p.cwiseAbs().array() - 1;
    double const expected = out.maxCoeff() > 0 ? out.cwiseMax(0).norm() : -out.maxCoeff();
    EXPECT_NEAR(scene.distance(p, 10), expected, 1e-5) << p.transpose();
    EXPECT_EQ(scene.distance(p, 0.5 * expected), 0.5 * expected);
  }
}

TEST(SceneSight, InsideIsWhereMostlyBacksAreSeen) {
  TriangleMesh mesh = make_rooms(1);
  add_column(mesh, 1, 1);
  SceneSight const scene(mesh, SceneWinding::trusted), either(mesh, SceneWinding::ignored);
  EXPECT_FALSE(scene.is_inside_object({0, 1.5, 0}));
  EXPECT_FALSE(scene.is_inside_object({20, 1.5, 0}));
  EXPECT_TRUE(scene.is_inside_object({1, 1.5, 1}));
  EXPECT_TRUE(scene.is_inside_object({3.1, 1.5, 0}));
  EXPECT_FALSE(either.is_inside_object({1, 1.5, 1}));
}

TEST(SceneSight, AWallIsSeenByTheRulesOnly) {
  TriangleMesh mesh;
  add_block(mesh, {-100, -100, -2}, {100, 100, 0});  // its front, z = 0, seen from z = 1
  SceneSight const scene(mesh, SceneWinding::trusted);
  Vector3d const eye(0, 0, 1);
  auto const count = [&](Vector3d const& node, SightRules const& rules) {
    int bits = 0;
    for (auto const word : scene.sees(node, scene.look_around(eye, 4096, rules, 1, 0))) bits += std::popcount(word);
    return bits;
  };
  SightRules any{.least_cosine = 0, .greatest_coarseness = 1e6};
  EXPECT_NEAR(count(eye, any), 2048, 30);                // half of everything
  EXPECT_EQ(count({0, 0, -3}, any), 0);                  // behind it
  EXPECT_EQ(count({0, 0, -1}, any), 0);                  // within it
  EXPECT_EQ(count(eye, SightRules{}), count(eye, any));  // an eye is good enough for itself
  // Here cos is height / d for both: d / sqrt(cos) is d^1.5 / sqrt(height).
  Vector3d const higher(0, 0, 4.5);
  int expected = 0;
  for (SeenPoint const& point : scene.look_around(eye, 4096, any, 1, 0)) {
    double const r2 = point.position.head<2>().squaredNorm();
    expected += point.is_there() && std::pow((r2 + 4.5 * 4.5) / (r2 + 1), 0.75) / std::sqrt(4.5) <= 4;
  }
  EXPECT_LT(expected, 2000);
  EXPECT_NEAR(count(higher, {.least_cosine = 0, .greatest_coarseness = 4}), expected, 3);
}

TEST(SceneSight, WhatAWallHidesIsUncovered) {
  TriangleMesh const mesh = make_rooms(2);
  SceneSight const scene(mesh, SceneWinding::trusted);
  Vector3d const left(0, 1.5, 0), right(6.2, 1.5, 0);
  SightRules const any{.least_cosine = 0, .greatest_coarseness = 1e6};
  EXPECT_EQ(uncovered_share(scene, {left}, left, 10000, any), 0);
  EXPECT_EQ(uncovered_share(scene, {left, right}, right, 10000, any), 0);
  EXPECT_NEAR(uncovered_share(scene, {}, left, 10000, any), 1, 1e-12);  // all of a closed room is surface
  EXPECT_GT(uncovered_share(scene, {left}, right, 10000, any), 0.7);
}

TEST(SceneSight, ImpossibleRulesAreNamed) {
  EXPECT_SCANVIEW_ERROR((SightRules{.least_cosine = 1}.validate()), ErrorCode::usage, "least_cosine");
  EXPECT_SCANVIEW_ERROR((SightRules{.greatest_coarseness = 0.5}.validate()), ErrorCode::usage, "greatest_coarseness");
  EXPECT_SCANVIEW_ERROR((SightRules{.sharp_from = -1}.validate()), ErrorCode::usage, "sharp_from");
}

}  // namespace
}  // namespace scanview
