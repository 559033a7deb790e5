#include "synth/church.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "synth/church_plan.h"
#include "synth/model_camera.h"
#include "synth/scanner.h"
#include "synth/scene_sight.h"
#include "tests/expect_error.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

TEST(Church, HasTheNumberOfTrianglesThatIsAskedFor) {
  for (std::size_t const polygons : {kChurchLeast, 170'000ul, 200'000ul, 350'000ul, 1'000'000ul}) {
    TriangleMesh const mesh = make_church(polygons);
    mesh.check();
    auto const count = static_cast<double>(mesh.triangles.size()), wanted = static_cast<double>(polygons);
    EXPECT_NEAR(count, wanted, 0.1 * wanted);
    EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());
  }
  EXPECT_SCANVIEW_ERROR(make_church(kChurchLeast - 1), ErrorCode::usage, "149999");
  EXPECT_SCANVIEW_ERROR(make_church(kChurchMost + 1), ErrorCode::usage, "10000001");
}

TEST(Church, IsClosedAtEveryFineness) {
  for (std::size_t const polygons : {kChurchLeast, 310'000ul}) {
    TriangleMesh const mesh = welded(make_church(polygons));
    EXPECT_TRUE(is_closed(mesh)) << polygons;
    for (auto const& t : mesh.triangles) EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
  }
}

TEST(Church, KeepsItsShapeWhateverTheNumberOfTriangles) {
  double const coarse = signed_volume(make_church(kChurchLeast)), fine = signed_volume(make_church(1'000'000));
  EXPECT_GT(coarse, 0);
  EXPECT_NEAR(coarse, fine, 2e-3 * fine) << "round things become a little rounder";
}

TEST(Church, OnlyTheWestEndIsOpen) {
  SceneSight const sight(make_church(kChurchLeast), SceneWinding::trusted);
  constexpr int kDirections = 4000;
  std::vector<Vector3d> const eyes = {{4, 8, 0},    {20, 3, 0},  {20, 14, 4}, {33, 6, -6},
                                      {10, 3, -10}, {35, 6, 10}, {39, 7, 9},  {42, 8, 0}};
  for (Vector3d const& eye : eyes)
    for (int n = 0; n < kDirections; ++n) {
      double const y = 1 - (2.0 * n + 1) / kDirections, r = std::sqrt(1 - y * y);
      double const azimuth = std::numbers::pi * (3 - std::sqrt(5.0)) * n;
      Vector3d const direction(r * std::sin(azimuth), y, r * std::cos(azimuth));
      auto const surface = sight.first_surface(eye, direction);
      if (surface) {
        EXPECT_TRUE(surface->is_front) << eye.transpose() << " towards " << direction.transpose();
        continue;
      }
      ASSERT_LT(direction.x(), 0);
      Vector3d const out = eye - eye.x() / direction.x() * direction;
      bool const is_nave = std::abs(out.z()) <= kNaveHalf, is_aisle = std::abs(out.z()) <= kAisleTo;
      EXPECT_TRUE(is_nave || is_aisle) << out.transpose();
      EXPECT_LT(out.y(), is_nave ? kVaultSpring + kNaveHalf + 0.3 : kArcadeTop) << out.transpose();
    }
}

TEST(Church, FromTheWestOneSeesTheInteriorAndTheEndsOfItsWalls) {
  SceneSight const sight(make_church(kChurchLeast), SceneWinding::trusted);
  Vector3d const eye(-300, 6, 0);
  int inside = 0, ends = 0;
  for (double y = -0.553; y < 17; y += 0.15)
    for (double z = -12.683; z < 12.8; z += 0.15) {
      auto const surface = sight.first_surface(eye, Vector3d(0, y, z) - eye);
      if (!surface) continue;
      EXPECT_TRUE(surface->is_front) << y << " " << z;
      Vector3d const hit = eye + surface->distance * (Vector3d(0, y, z) - eye);
      bool const is_end = hit.x()<0.4, is_interior = hit.y()> - 1e-4 && hit.y() < 16.3 && std::abs(hit.z()) <= kAisleTo;
      (is_end ? ends : inside)++;
      EXPECT_TRUE(is_end || is_interior) << hit.transpose();
    }
  EXPECT_GT(inside, 3 * ends);
}

TEST(Church, NaveAndAislesAreLit) {
  Context context;
  ModelCameraOptions options;
  options.surface.directions = 96;
  ModelCamera camera(make_church(kChurchLeast), options, context);
  for (Vector3d const& eye : {Vector3d(16, 2, 0), Vector3d(20, 2, 10), Vector3d(36, 3, -2)}) {
    CapturedNode const node = capture_node(camera, eye, 24, "000", context);
    double sum = 0;
    for (View const& side : node.sides) sum += cv::mean(side.image.color)[1] / kCubeSides;
    EXPECT_GT(sum, 90) << eye.transpose();
    EXPECT_LT(sum, 190) << eye.transpose();
  }
}

TEST(Church, IsABuiltInModelOfAnySize) {
  EXPECT_TRUE(is_builtin_model("church"));
  EXPECT_TRUE(is_builtin_model("church:160000"));
  EXPECT_FALSE(is_builtin_model("churches"));
  EXPECT_EQ(builtin_model("church").triangles.size(), make_church(200'000).triangles.size());
  TriangleMesh const a = builtin_model("church:160000"), b = make_church(160'000);
  EXPECT_EQ(a.vertices, b.vertices) << "always the same";
  EXPECT_EQ(a.triangles, b.triangles);
  for (char const* const bad : {"church:", "church:x", "church:160000 "})
    EXPECT_SCANVIEW_ERROR(builtin_model(bad), ErrorCode::usage, "church:POLYGONS");
  EXPECT_SCANVIEW_ERROR(builtin_model("church:5"), ErrorCode::usage, "150000");
}

}  // namespace
}  // namespace scanview
