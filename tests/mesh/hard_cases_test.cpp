#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "mesh/view_mesh.h"
#include "tests/mesh/depth_maps.h"
#include "tests/mesh/reference_raster.h"

namespace scanview {
namespace {

using namespace testing;

double const kNaN = std::numeric_limits<double>::quiet_NaN();

/// Meshes, and checks what must hold of any image.
ViewMeshResult mesh(RangeImage const& image, MeshOptions options = {}) {
  Context context;
  ViewMeshResult const result = mesh_range_image(image, options, context);
  EXPECT_NO_THROW(result.view_mesh.check());
  ReferenceRaster const reference = reference_raster(image, result.view_mesh.mesh);
  EXPECT_EQ(reference.covered_background, 0u);
  EXPECT_LE(reference.max_over_sigma, result.tolerance);
  return result;
}

MeshOptions everything() {
  MeshOptions options;
  options.min_patch_pixels = 1;
  options.fill_pixels = 0;
  options.max_angle_deg = 89.99;
  return options;
}

TEST(HardCases, NoDepthAtAllIsAnEmptyMesh) {
  ViewMeshResult const result = mesh(depth_map(small_camera(), 1e-3, [](int, int) { return kNaN; }));
  EXPECT_EQ(result.figures.triangles, 0u);
  EXPECT_EQ(result.figures.uncovered, 0);
  EXPECT_EQ(cv::countNonZero(result.view_mesh.feather), 0);
}

TEST(HardCases, ASinglePixelIsDroppedUnlessAskedFor) {
  RangeImage const image =
      depth_map(small_camera(), 1e-3, [](int x, int y) { return x == 10 && y == 20 ? 1.0 : kNaN; });
  ViewMeshResult const dropped = mesh(image);
  EXPECT_EQ(dropped.figures.triangles, 0u);
  EXPECT_EQ(dropped.figures.uncovered, 1);
  ViewMeshResult const kept = mesh(image, everything());
  EXPECT_GE(kept.figures.triangles, 1u);
  EXPECT_EQ(kept.figures.uncovered, 0);
}

TEST(HardCases, AnImageOfOnePixel) {
  RangeImage const image = depth_map(small_camera(1, 1), 1e-3, [](int, int) { return 1.0; });
  EXPECT_EQ(mesh(image, everything()).figures.uncovered, 0);
}

TEST(HardCases, LinesOfPixelsAreCovered) {
  auto const on_line = [](int x, int y) {
    return x == 5 || y == 7 || x == y + 20 || 3 * y == x + 60 ? 2.0 + 0.001 * x : kNaN;
  };
  RangeImage const image = depth_map(small_camera(), 1e-3, on_line);
  EXPECT_EQ(mesh(image, everything()).figures.uncovered, 0);
}

TEST(HardCases, WiresBeforeAWallKeepTheirDepth) {
  auto const depth = [](int x, int y) { return x % 9 == 4 ? 1.5 + 0.001 * y : 2.0; };
  ViewMeshResult const result = mesh(depth_map(small_camera(), 1e-3, depth));
  EXPECT_EQ(result.figures.uncovered, 0);
  for (Eigen::Vector3i const& t : result.view_mesh.mesh.triangles) {
    auto const& v = result.view_mesh.mesh.vertices;
    EXPECT_EQ(v[t[0]].z() < 1.75, v[t[1]].z() < 1.75);
    EXPECT_EQ(v[t[0]].z() < 1.75, v[t[2]].z() < 1.75);
  }
}

TEST(HardCases, ARingHasAHole) {
  RangeImage const image = depth_map(small_camera(), 1e-3, [](int x, int y) {
    double const radius = std::hypot(x - 48, y - 40);
    return radius > 15 && radius < 30 ? 2.0 : kNaN;
  });
  EXPECT_EQ(mesh(image).figures.uncovered, 0);
}

TEST(HardCases, ACheckerboardOfMissingDepths) {
  RangeImage const image = depth_map(small_camera(), 1e-3, [](int x, int y) { return (x + y) % 2 == 0 ? 2.0 : kNaN; });
  EXPECT_EQ(mesh(image).figures.triangles, 0u);
  EXPECT_EQ(mesh(image, everything()).figures.uncovered, 0);
}

TEST(HardCases, ACheckerboardOfTwoDepths) {
  RangeImage const image = depth_map(small_camera(), 1e-3, [](int x, int y) { return (x + y) % 2 == 0 ? 2.0 : 2.5; });
  EXPECT_EQ(mesh(image, everything()).figures.uncovered, 0);
}

TEST(HardCases, RandomMasksOfAnyDensityAreCoveredExactly) {
  for (int percent : {5, 30, 50, 60, 75, 95}) {
    SCOPED_TRACE(percent);
    RangeImage const image = depth_map(small_camera(64, 48), 1e-3, [&](int x, int y) {
      CounterRandom random(11, std::uint64_t(y) << 32 | std::uint32_t(x), percent);
      return random.uniform() * 100 < percent ? 2.0 + 0.002 * random.normal() : kNaN;
    });
    EXPECT_EQ(mesh(image, everything()).figures.uncovered, 0);
  }
}

TEST(HardCases, RandomDepthsOfAllScales) {
  // Every pixel its own depth between 1 and 10^6: nothing is a surface, nothing may go wrong.
  for (bool perspective : {true, false}) {
    Camera const camera = perspective ? small_camera(48, 40) : small_orthographic(48, 40);
    RangeImage const image = depth_map(camera, 1e-3, [](int x, int y) {
      return std::pow(10.0, 6 * CounterRandom(5, std::uint64_t(y) << 32 | std::uint32_t(x)).uniform());
    });
    // Slopes of a million units a pixel: the 1e-4 pixels of single precision alone cost more than a tolerance of 1e-3.
    Context context;
    for (MeshOptions const& options : {MeshOptions{}, everything()})
      EXPECT_NO_THROW(mesh_range_image(image, options, context).view_mesh.check());
  }
}

TEST(HardCases, DepthFromOneToAMillionOnOneSurface) {
  Camera const camera = Camera::perspective(200, 200, 100, 100, 99.5, 0.5);
  // A floor one unit below the eye that runs to a million units: sigma grows with the square of the depth.
  RangeImage image = depth_map(camera, 1, [](int, int y) { return 100 / (y - 0.5 + 1e-4); });
  for (int y = 0; y < 200; ++y)
    for (int x = 0; x < 200; ++x) {
      double const z = 100 / (std::abs(y - 0.5) + 1e-4);
      image.depth(y, x) = float(y == 0 ? 1e6 : z);
      image.sigma(y, x) = float(1e-5 * z * z);
    }
  ViewMeshResult const result = mesh(image, everything());
  EXPECT_GT(result.figures.triangles, 0u);
}

TEST(HardCases, StepsOnePixelLong) {
  for (double height : {0.001, 0.01, 0.1, 1.0})
    mesh(depth_map(small_camera(), 1e-4, [&](int x, int y) { return 2 + height * ((x + y) % 3); }), everything());
}

TEST(HardCases, APlaneAt89DegreesHasNoSteps) {
  Camera const camera = small_orthographic();
  double const slope = std::tan(89 * 3.14159265358979 / 180) * 0.01;
  RangeImage const image = depth_map(camera, 1e-3, [&](int x, int) { return 5 + slope * x; });
  MeshOptions options = everything();
  ViewMeshResult const result = mesh(image, options);
  EXPECT_EQ(result.figures.triangles, 2u);
  EXPECT_EQ(mesh(image).figures.triangles, 0u) << "all seen at more than 87 degrees";
}

TEST(HardCases, ConeTipTowardsAndAwayFromTheCamera) {
  Camera const camera = small_orthographic();
  for (double slope : {0.02, -0.02}) {
    RangeImage const image = depth_map(
        camera, 1e-4, [&](int x, int y) { return 5 + slope * std::hypot(x - camera.cx() + 0.3, y - camera.cy()); });
    EXPECT_EQ(mesh(image).figures.uncovered, 0);
  }
}

TEST(HardCases, HugeSigmasInPlaces) {
  Camera const camera = small_camera();
  RangeImage image = depth_map(camera, 1e-3, [&](int x, int y) {
    return 2 + 0.01 * std::sin(0.3 * x) + (x > 50 ? 1.0 : 0.0) + 0.01 * normal_noise(2, x, y);
  });
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 96; ++x)
      if (x > 20 && x < 60 && y % 7 < 3)
        image.sigma(y, x) = y % 3 ? 1e3f : x % 2 ? 1e30f : std::numeric_limits<float>::max();
  mesh(image);
  mesh(image, everything());
}

TEST(HardCases, SigmasNearZeroInPlaces) {
  // Zero itself is refused where an image is made; below what single precision can tell nothing can be within.
  Camera const camera = small_camera(48, 40);
  RangeImage image = depth_map(camera, 1e-3, [&](int x, int y) { return 2 + 0.01 * std::sin(0.3 * x) * std::cos(y); });
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 48; ++x)
      if (x > 10 && x < 30 && y % 5 < 2) image.sigma(y, x) = y % 2 ? 1e-30f : 1e-12f;
  Context context;
  MeshOptions options = everything();
  options.max_angle_deg = 90;  // what follows every last digit is steep
  ViewMeshResult const result = mesh_range_image(image, options, context);
  EXPECT_NO_THROW(result.view_mesh.check());
  EXPECT_EQ(reference_raster(image, result.view_mesh.mesh).uncovered, 0u);
  image.sigma(7, 7) = 0;
  EXPECT_THROW(mesh_range_image(image, {}, context), std::logic_error);
}

TEST(HardCases, ManyCocircularPoints) {
  // Equal bumps on a regular grid put equal vertices on regular places.
  RangeImage const image =
      depth_map(small_camera(97, 81), 1e-5, [](int x, int y) { return 2 + (x % 8 == 0 && y % 8 == 0 ? 0.01 : 0.0); });
  EXPECT_EQ(mesh(image).figures.uncovered, 0);
}

TEST(HardCases, AMillionCocircularGridPoints) {
  RangeImage const image = depth_map(small_orthographic(1024, 1024), 1e-5,
                                     [](int x, int y) { return 2 + (x % 16 == 0 && y % 16 == 0 ? 0.001 : 0.0); });
  Context context;
  ViewMeshResult const result = mesh_range_image(image, {}, context);
  EXPECT_EQ(result.figures.uncovered, 0);
  EXPECT_LE(result.figures.max, result.tolerance * 1e-5);
}

TEST(HardCases, TwelveMegapixels) {
  Camera const camera = Camera::perspective(4000, 3000, 4000, 4000, 1999.5, 1499.5);
  RangeImage const image =
      depth_map(camera, 1e-3, [](int x, int y) { return 3 + 0.1 * std::sin(0.004 * x) * std::cos(0.005 * y); });
  MeshOptions options;
  options.tolerance_kind = MeshOptions::Tolerance::units;
  options.tolerance = 0.002;
  Context context;
  ViewMeshResult const result = mesh_range_image(image, options, context);
  EXPECT_EQ(result.figures.uncovered, 0);
  EXPECT_LE(result.figures.max, options.tolerance);
  EXPECT_LT(result.figures.triangles, 5000u) << "as many as the surface needs, however many pixels show it";
}

TEST(HardCases, AStepThatEndsInsideTheSurface) {
  // A slit: left and right of it the ground parts, more and more towards the top.
  RangeImage const image = depth_map(small_camera(), 1e-4, [](int x, int y) {
    double const rise = std::max(0.0, 40.0 - y) * 0.005 * std::exp(-0.002 * (x - 48) * (x - 48));
    return x < 48 ? 2 + rise : 2 - rise;
  });
  EXPECT_EQ(mesh(image, everything()).figures.uncovered, 0);
}

}  // namespace
}  // namespace scanview
