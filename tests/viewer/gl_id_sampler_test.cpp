#include "viewer/visibility/gl_id_sampler.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "base/error.h"
#include "viewer/raster_reference.h"
#include "viewer/visibility/triangle_sampler.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

/// A bumpy ball and smaller ones around it, which hide each other, and an open sheet that shows its back.
TriangleMesh scene() {
  TriangleMesh mesh;
  auto const add = [&](TriangleMesh const& part, float scale, Eigen::Vector3f const& at, float bumps) {
    int const base = static_cast<int>(mesh.vertices.size());
    for (auto const& v : part.vertices) {
      float const swell = 1 + bumps * std::sin(9 * v.x()) * std::sin(8 * v.y()) * std::sin(7 * v.z());
      mesh.vertices.push_back(scale * swell * v + at);
    }
    for (auto const& t : part.triangles) mesh.triangles.push_back(t + Eigen::Vector3i::Constant(base));
  };
  add(test::sphere_mesh(120, 60), 1, {0, 0, 0}, 0.15F);
  for (int i = 0; i < 5; ++i) {
    auto const a = static_cast<float>(1.3 * i);
    add(test::sphere_mesh(30, 15), 0.25F, {1.2F * std::cos(a), 1.2F * std::sin(a), 0.3F * static_cast<float>(i - 2)},
        0);
  }
  add(test::grid(20, 20, [](int x, int y) { return Vector3d(0.1 * x - 1, 0.1 * y - 1, 1.4 + 0.001 * x * y); }), 1,
      {0, 0, 0}, 0);
  return mesh;
}

TEST(GlIdSampler, DrawsWhatTheRasteriserDraws) {
  TriangleMesh const mesh = scene();
  Eigen::AlignedBox3d bounds;
  for (auto const& vertex : mesh.vertices) bounds.extend(vertex.cast<double>());
  double const radius = 0.5 * bounds.diagonal().norm();
  TrianglePlanes const planes(mesh, bounds.center(), radius);
  std::vector<std::uint32_t> labels(mesh.triangles.size());
  for (std::size_t i = 0; i < labels.size(); ++i) labels[i] = static_cast<std::uint32_t>(i);
  RasterMesh const raster = raster_mesh(mesh, labels);
  TriangleSampler sampler(raster, planes, bounds);
  auto const context = make_offscreen_context();
  GlIdSampler gl(*context, mesh);

  for (double const distance : {1.3, 3.0, std::numeric_limits<double>::infinity()}) {
    for (auto const& direction : {Vector3d(0.3, 0.2, 0.9), Vector3d(-1, 0.4, 0.1), Vector3d(0.2, 0.3, -1)}) {
      SCOPED_TRACE(testing::Message() << "distance " << distance << ", direction " << direction.transpose());
      SampleCamera const camera = ball_camera(bounds.center(), radius, direction, distance, 500);
      sampler.sample(camera, Seen::in_picture);
      cv::Mat1i expected(500, 500, kNoTriangle);
      sampler.for_each_pixel(
          [&](int x, int y, std::uint32_t triangle) { expected(y, x) = static_cast<int>(triangle); });
      cv::Mat1f const depth = draw_id_buffer(mesh, camera.camera, camera.object_from_camera).depth;
      IdBuffer const& drawn = gl.draw(camera);
      int shown = 0, other = 0, off = 0;
      for (int y = 0; y < 500; ++y) {
        for (int x = 0; x < 500; ++x) {
          bool const same = drawn.id(y, x) == expected(y, x);
          shown += expected(y, x) != kNoTriangle;
          other += !same;
          EXPECT_EQ(drawn.id(y, x) == kNoTriangle, std::isnan(drawn.depth(y, x)));
          if (same && expected(y, x) != kNoTriangle)
            off += !(std::abs(drawn.depth(y, x) - depth(y, x)) < 1e-3 * radius);
        }
      }
      EXPECT_GT(shown, 20000);
      EXPECT_LE(other, 3e-4 * shown);
      // Nearly edge-on, the rounding of vertices is felt in the depths of what they span.
      EXPECT_LE(off, 1e-3 * shown);
    }
  }
}

TEST(GlIdSampler, NothingIsThereWhereNothingIs) {
  auto const context = make_offscreen_context();
  GlIdSampler empty(*context, TriangleMesh{});
  SampleCamera const camera = ball_camera(Vector3d::Zero(), 1, {0, 0, 1}, 3, 40);
  EXPECT_EQ(cv::countNonZero(empty.draw(camera).id != kNoTriangle), 0);
  GlIdSampler ball(*context, test::sphere_mesh(20, 10));
  SampleCamera away = camera;
  away.object_from_camera.rotate(Eigen::AngleAxisd(3.14159, Vector3d::UnitY()));
  EXPECT_GT(cv::countNonZero(ball.draw(camera).id != kNoTriangle), 500);
  EXPECT_EQ(cv::countNonZero(ball.draw(away).id != kNoTriangle), 0);
  // Another size, and from within: the other side's back.
  SampleCamera within = ball_camera(Vector3d::Zero(), 1, {0, 0, 1}, 3, 60);
  within.object_from_camera.translation().setZero();
  EXPECT_EQ(cv::countNonZero(ball.draw(within).id == kNoTriangle), 0);
  EXPECT_THROW(ball.draw(ball_camera(Vector3d::Zero(), 1, {0, 0, 1}, 3, 1 << 20)), Error);
}

}  // namespace
}  // namespace scanview
