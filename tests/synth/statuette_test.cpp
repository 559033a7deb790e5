#include "synth/statuette.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "synth/ray_scene.h"
#include "synth/scanner.h"
#include "synth/statuette_plan.h"
#include "tests/expect_error.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

TEST(Statuette, IsAClosedOutwardColouredObjectOfTheSizeItClaims) {
  TriangleMesh const mesh = builtin_model("statuette");
  mesh.check();
  EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());
  EXPECT_GT(mesh.triangles.size(), 300'000u);
  EXPECT_LT(mesh.triangles.size(), 800'000u);
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_GT(signed_volume(mesh), 1e5);  // mm³
  Eigen::AlignedBox3f box;
  for (auto const& v : mesh.vertices) box.extend(v);
  EXPECT_NEAR(box.min().y(), 0, 0.01);
  EXPECT_NEAR(box.max().y(), 91, 1);
  EXPECT_LT(box.sizes().maxCoeff(), 100);
}

TEST(Statuette, OneSeesThroughItsRing) {
  Context context;
  TriangleMesh const mesh = make_statuette(1, context);
  RayScene const scene(mesh.vertices, mesh.triangles);
  Eigen::Vector3f const axis = Eigen::Vector3f(-0.45f, 0.22f, 0.9f).normalized();
  RayHit const through = scene.first_hit(kHoop + 60 * axis, -axis);
  EXPECT_TRUE(through.triangle < 0 || through.distance > 60 + kHoopMinor);
  RayHit const rim =
      scene.first_hit(kHoop + 60 * axis + kHoopMajor * axis.cross(Eigen::Vector3f(0, 1, 0)).normalized(), -axis);
  ASSERT_GE(rim.triangle, 0);
  EXPECT_NEAR(rim.distance, 60 - kHoopMinor, 0.1);  // a tenth of the grid's spacing
}

TEST(Statuette, IsTheSameForAnyNumberOfThreads) {
  Context one, four;
  one.threads = 1;
  four.threads = 4;
  TriangleMesh const a = make_statuette(1.2f, one), b = make_statuette(1.2f, four);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.colors, b.colors);
}

TEST(BuiltinModel, UnknownNameIsRefusedWithTheKnownOnes) {
  EXPECT_SCANVIEW_ERROR(builtin_model("teapot"), ErrorCode::usage, "teapot");
  EXPECT_SCANVIEW_ERROR(builtin_model(""), ErrorCode::usage, "statuette");
}

}  // namespace
}  // namespace scanview
