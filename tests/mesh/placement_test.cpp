#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/core.hpp>

#include "mesh/hole_fill.h"
#include "mesh/view_mesh.h"
#include "tests/mesh/depth_maps.h"
#include "tests/mesh/reference_raster.h"

namespace scanview {
namespace {

using namespace testing;

double const kNaN = std::numeric_limits<double>::quiet_NaN();

/// A ball before a wavy wall.
RangeImage ball_and_wall(Camera const& camera) {
  return depth_map(camera, 1e-3, [&](int x, int y) {
    double const ball = sphere_depth(camera, {0.05, -0.1, 3}, 0.5, x, y);
    return std::isnan(ball) ? 4 + 0.05 * std::sin(0.12 * x) * std::cos(0.1 * y) : ball;
  });
}

class EveryPlacement : public ::testing::TestWithParam<std::tuple<MeshOptions::Placement, MeshOptions::Fit, bool>> {};

TEST_P(EveryPlacement, KeepsToleranceCoverageAndSteps) {
  auto const [placement, fit, perspective] = GetParam();
  Camera const camera = perspective ? small_camera(80, 60) : Camera::orthographic(80, 60, 0.024, 0.024, 39.5, 29.5);
  RangeImage const image = ball_and_wall(camera);
  MeshOptions options;
  options.placement = placement;
  options.fit = fit;
  options.tolerance_kind = MeshOptions::Tolerance::units;
  options.tolerance = 0.005;
  options.max_angle_deg = 90;  // the ball's rim, too, and single pixels on it
  options.min_patch_pixels = 1;
  Context context;
  ViewMeshResult const result = mesh_range_image(image, options, context);
  ReferenceRaster const raster = reference_raster(image, result.view_mesh.mesh);
  EXPECT_LE(raster.max_error, options.tolerance);
  EXPECT_EQ(raster.covered_background, 0u);
  EXPECT_EQ(raster.uncovered, 0u);
  for (Eigen::Vector3i const& t : result.view_mesh.mesh.triangles) {
    float nearest = INFINITY, farthest = 0;
    for (int i = 0; i < 3; ++i) {
      nearest = std::min(nearest, result.view_mesh.mesh.vertices[t[i]].z());
      farthest = std::max(farthest, result.view_mesh.mesh.vertices[t[i]].z());
    }
    // The ball ends at depth 3, the wall begins at 3.95.
    EXPECT_FALSE(nearest < 3.1f && farthest > 3.8f) << "a triangle spans the step";
  }
  ViewMeshResult const again = mesh_range_image(image, options, context);
  EXPECT_EQ(again.view_mesh.mesh.vertices, result.view_mesh.mesh.vertices);
  EXPECT_EQ(again.view_mesh.mesh.triangles, result.view_mesh.mesh.triangles);
}

INSTANTIATE_TEST_SUITE_P(
    Placements, EveryPlacement,
    ::testing::Combine(::testing::Values(MeshOptions::Placement::insertion, MeshOptions::Placement::probing,
                                         MeshOptions::Placement::decimation),
                       ::testing::Values(MeshOptions::Fit::none, MeshOptions::Fit::depths, MeshOptions::Fit::joint),
                       ::testing::Bool()));

TEST(Fit, NeedsFewerTrianglesThanInsertionAloneAndLeavesLess) {
  RangeImage const image = ball_and_wall(small_camera(160, 120));
  MeshOptions options;
  options.tolerance_kind = MeshOptions::Tolerance::units;
  options.tolerance = 0.005;
  Context context;
  std::vector<MeshFigures> figures;
  for (auto const fit : {MeshOptions::Fit::none, MeshOptions::Fit::depths, MeshOptions::Fit::joint}) {
    options.fit = fit;
    figures.push_back(mesh_range_image(image, options, context).figures);
  }
  EXPECT_LT(figures[2].triangles, figures[0].triangles * 2 / 3);
  EXPECT_LT(figures[2].rms, figures[0].rms);
  options.max_triangles = int(figures[0].triangles);
  MeshFigures const spent = mesh_range_image(image, options, context).figures;
  EXPECT_LE(spent.triangles, figures[0].triangles);
  EXPECT_LT(spent.rms, 0.6 * figures[0].rms);
  EXPECT_LE(spent.max, options.tolerance);
}

TEST(Probing, OtherSeedsProbeOtherPlaces) {
  RangeImage const image = ball_and_wall(small_camera(128, 96));
  MeshOptions options;
  options.placement = MeshOptions::Placement::probing;
  options.fit = MeshOptions::Fit::none;
  Context one, other;
  other.seed = 2;
  EXPECT_NE(mesh_range_image(image, options, one).view_mesh.mesh.vertices,
            mesh_range_image(image, options, other).view_mesh.mesh.vertices);
}

/// RMS distance from points of the mesh's border to a circle in the picture.
TEST(Silhouette, IsWithinHalfAPixelOfTheTrueOutline) {
  for (bool const perspective : {true, false}) {
    Camera const camera = perspective ? Camera::perspective(320, 240, 300, 300, 159.5, 119.5)
                                      : Camera::orthographic(320, 240, 0.01, 0.01, 159.5, 119.5);
    // On the axis: its outline is a circle. A disc faces the camera, so that no pixel of its rim is too grazing.
    double const radius_px = 91.3;
    RangeImage const image = depth_map(camera, 1e-3, [&](int x, int y) {
      return std::hypot(x - camera.cx(), y - camera.cy()) < radius_px ? 3.0 + 0.0005 * x : kNaN;
    });
    Context context;
    TriangleMesh const mesh = mesh_range_image(image, {}, context).view_mesh.mesh;
    std::map<std::pair<int, int>, int> edges;
    for (Eigen::Vector3i const& t : mesh.triangles)
      for (int i = 0; i < 3; ++i) ++edges[std::minmax(t[i], t[(i + 1) % 3])];
    double squares = 0, length = 0;
    for (auto const& [edge, count] : edges) {
      if (count != 1) continue;
      Eigen::Vector2d const a = camera.project(mesh.vertices[edge.first].cast<double>());
      Eigen::Vector2d const b = camera.project(mesh.vertices[edge.second].cast<double>());
      for (double s = 0.05; s < 1; s += 0.1) {
        double const off = (a + s * (b - a) - Eigen::Vector2d(camera.cx(), camera.cy())).norm() - radius_px;
        squares += off * off * (b - a).norm() / 10;
      }
      length += (b - a).norm();
    }
    EXPECT_NEAR(length, 2 * std::numbers::pi * radius_px, 0.02 * length);
    RecordProperty(perspective ? "perspective_px" : "orthographic_px", std::to_string(std::sqrt(squares / length)));
    EXPECT_LE(std::sqrt(squares / length), 0.5);
  }
}

TEST(HoleFill, BridgesLostPixelsButNoStepsAndNoBackground) {
  Camera const camera = small_camera();
  auto const hole = [](int x, int y) { return (x == 30 && y == 20) || (x >= 60 && x < 63 && y >= 40 && y < 43); };
  auto const plane = [&](int x, int y) { return plane_depth(camera, {0.4, 0.2, 1}, 3, x, y); };
  RangeImage image = depth_map(camera, 1e-3, [&](int x, int y) { return hole(x, y) ? kNaN : plane(x, y); });
  RangeImage const filled = fill_small_holes(image, 6, 9);
  EXPECT_EQ(filled.count_depths(), 96u * 80u);
  filled.check();
  for (auto const& [x, y] : {std::pair(30, 20), std::pair(61, 41)}) EXPECT_NEAR(filled.depth(y, x), plane(x, y), 1e-6);
  EXPECT_EQ(fill_small_holes(image, 6, 8).count_depths(), 96u * 80u - 9u) << "nine pixels are more than eight";
  Context context;
  ViewMeshResult const result = mesh_range_image(image, {}, context);
  EXPECT_EQ(result.figures.triangles, 2u);
  EXPECT_EQ(result.figures.uncovered, 0) << "of pixels that have a depth";

  image.remove(30, 20, PixelClass::background);
  EXPECT_FALSE(fill_small_holes(image, 6, 9).has_depth(30, 20)) << "known to be background";
  RangeImage const on_step = depth_map(camera, 1e-3, [&](int x, int y) {
    return x == 30 && y == 20 ? kNaN : x < 30 ? 2.0 : 2.5;
  });
  EXPECT_FALSE(fill_small_holes(on_step, 6, 9).has_depth(30, 20)) << "beside a step";
  RangeImage const at_rim = depth_map(camera, 1e-3, [&](int x, int y) { return x == 0 && y == 20 ? kNaN : 2.0; });
  EXPECT_FALSE(fill_small_holes(at_rim, 6, 9).has_depth(0, 20)) << "nothing beyond the picture's edge";
}

}  // namespace
}  // namespace scanview
