#include "synth/isosurface.h"

#include <gtest/gtest.h>

#include <numbers>

#include "synth/distance_field.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

TEST(Isosurface, OfASphereIsClosedOutwardAndOnTheSphere) {
  Context context;
  float const radius = 10, spacing = 0.5f;
  auto const distance = [&](Vector3f const& p) { return sphere_distance(p, {1, 2, 3}, radius); };
  TriangleMesh const mesh = polygonise(distance, {Vector3f(-10, -9, -8), Vector3f(12, 13, 14)}, spacing, 1, context);
  mesh.check();
  EXPECT_TRUE(is_closed(mesh));
  for (auto const& v : mesh.vertices) EXPECT_LT(std::abs(distance(v)), 1e-3f * spacing);  // where Newton stops
  double const ball = 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
  // Chords of at most √3 cells cut off a relative 3 (ρ/R)²/2, ρ = √3/2 cells half a chord: 0.3 %.
  EXPECT_NEAR(signed_volume(mesh), ball, 0.003 * ball);
  double const expected = 3 * 4 * std::numbers::pi * radius * radius / (spacing * spacing);
  EXPECT_NEAR(static_cast<double>(mesh.triangles.size()), expected, 0.02 * expected);
}

TEST(Isosurface, OfARingHasAHole) {
  Context context;
  TriangleMesh const mesh = polygonise([](Vector3f const& p) { return ring_distance(p, 8, 2); },
                                       {Vector3f(-11, -11, -3), Vector3f(11, 11, 3)}, 0.4f, 1, context);
  EXPECT_TRUE(is_closed(mesh));
  // Euler characteristic of a torus: V - E + F = 0, with E = 3/2 F.
  EXPECT_EQ(2 * mesh.vertices.size(), mesh.triangles.size());
}

TEST(Isosurface, IsTheSameForAnyNumberOfThreads) {
  auto const make = [](int threads) {
    Context context;
    context.threads = threads;
    return polygonise(
        [](Vector3f const& p) {
          return ellipsoid_distance(p, {0, 0, 0}, {5, 3, 2});
        },
        {Vector3f(-6, -4, -3), Vector3f(6, 4, 3)}, 0.2f, 1.5f, context);
  };
  TriangleMesh const one = make(1), four = make(4);
  EXPECT_EQ(one.vertices, four.vertices);
  EXPECT_EQ(one.triangles, four.triangles);
}

TEST(Isosurface, WithoutSurfaceIsEmpty) {
  Context context;
  EXPECT_TRUE(
      polygonise([](Vector3f const&) { return 1.0f; }, {Vector3f(-1, -1, -1), Vector3f(1, 1, 1)}, 0.2f, 1, context)
          .triangles.empty());
}

}  // namespace
}  // namespace scanview
