#include <gtest/gtest.h>

#include <chrono>
#include <filesystem>
#include <functional>
#include <numbers>

#include "base/error.h"
#include "mesh/mesh_error.h"
#include "mesh/view_mesh.h"
#include "tests/mesh/depth_maps.h"
#include "tests/mesh/reference_raster.h"

namespace scanview {
namespace {

using namespace testing;

double const kNaN = std::numeric_limits<double>::quiet_NaN();

MeshOptions within_units(double tolerance) {
  MeshOptions options;
  options.tolerance_kind = MeshOptions::Tolerance::units;
  options.tolerance = tolerance;
  return options;
}

ViewMeshResult mesh(RangeImage const& image, MeshOptions const& options = {}) {
  Context context;
  return mesh_range_image(image, options, context);
}

/// Normals face the camera, cosines are the triangles' own, figures are the reference's.
void expect_sound(RangeImage const& image, ViewMeshResult const& result) {
  ViewMesh const& vm = result.view_mesh;
  ASSERT_NO_THROW(vm.check());
  for (std::size_t t = 0; t < vm.mesh.triangles.size(); ++t) {
    Eigen::Vector3d p[3];
    for (int i = 0; i < 3; ++i) p[i] = vm.mesh.vertices[vm.mesh.triangles[t][i]].cast<double>();
    Eigen::Vector3d const normal = (p[1] - p[0]).cross(p[2] - p[0]).normalized();
    Eigen::Vector3d ray(0, 0, 1);
    if (image.camera.is_perspective()) ray = (p[0] + p[1] + p[2]).normalized();
    double const cosine = -normal.dot(ray);
    ASSERT_GE(cosine, std::cos(89 * std::numbers::pi / 180)) << "triangle " << t;
    ASSERT_NEAR(cosine, vm.cos_phi[t], 1e-6);
  }
  ReferenceRaster const reference = reference_raster(image, vm.mesh);
  EXPECT_EQ(result.figures.triangles, vm.mesh.triangles.size());
  EXPECT_EQ(reference.covered_background, 0u) << "no triangle reaches a pixel without depth";
  // Where edges pass through a centre to rounding, one rasteriser may count a triangle the other does not.
  EXPECT_NEAR(result.figures.uncovered, reference.object ? double(reference.uncovered) / reference.object : 0, 1e-3);
  EXPECT_LE(result.figures.rms, result.figures.max);
}

struct Scene {
  char const* name;
  double (*depth)(Camera const&, int, int);
};

double tilted_plane(Camera const& c, int x, int y) { return plane_depth(c, {0.6, 0.3, 1}, 3, x, y); }
double sphere(Camera const& c, int x, int y) { return sphere_depth(c, {0, 0, 3}, 1, x, y); }
double wedge_with_step(Camera const& c, int x, int y) {
  // Two planes that meet in a roof, the right half half a unit nearer below the middle row.
  double const sign = x < c.cx() ? 1 : -1;
  double const z = plane_depth(c, {sign * 0.5, 0, 1}, 3, x, y);
  return y > c.cy() && x > c.cx() ? z - 0.5 : z;
}
double cone(Camera const& c, int x, int y) {
  // Tip towards the camera; slope 2, so that its sides are seen at no more than about 75 degrees.
  double const radius = std::hypot(x - c.cx(), y - c.cy());
  return radius < 36 ? 2 + 0.02 * radius : kNaN;
}
double stairs(Camera const&, int x, int) { return 3 - 0.2 * (x / 12); }
double waves(Camera const&, int x, int y) { return 3 + 0.1 * std::sin(x * 0.15) * std::cos(y * 0.11); }
double two_spheres(Camera const& c, int x, int y) {
  double const front = sphere_depth(c, {-0.3, 0, 2}, 0.4, x, y);
  return std::isnan(front) ? sphere_depth(c, {0.3, 0.1, 3.5}, 1, x, y) : front;
}

Scene const kScenes[] = {{"plane", tilted_plane}, {"sphere", sphere}, {"wedge", wedge_with_step},  {"cone", cone},
                         {"stairs", stairs},      {"waves", waves},   {"two_spheres", two_spheres}};

struct Case {
  Scene scene;
  bool perspective;
  double tolerance;  // units
  double noise;      // units, of the depths
};

class EveryScene : public ::testing::TestWithParam<Case> {
 protected:
  RangeImage image() const {
    Case const& c = GetParam();
    Camera const camera = c.perspective ? small_camera() : small_orthographic();
    return depth_map(camera, std::max(c.noise, 1e-3),
                     [&](int x, int y) { return c.scene.depth(camera, x, y) + c.noise * normal_noise(7, x, y); });
  }
};

std::vector<Case> all_cases() {
  std::vector<Case> cases;
  for (Scene const& scene : kScenes)
    for (bool perspective : {true, false})
      for (double tolerance : {0.05, 0.005, 0.0005})
        for (double noise : {0.0, 0.002}) cases.push_back({scene, perspective, tolerance, noise});
  return cases;
}

TEST_P(EveryScene, IsWithinToleranceForAnIndependentRasteriserOfTheFile) {
  RangeImage const range = image();
  MeshOptions const options = within_units(GetParam().tolerance);
  ViewMeshResult const result = mesh(range, options);
  expect_sound(range, result);

  std::filesystem::path const folder = std::filesystem::path(::testing::TempDir()) / "scanview_mesh_file";
  std::filesystem::create_directories(folder);
  write_view_mesh(folder, result.view_mesh);
  ReferenceRaster const reference = reference_raster(range, read_triangle_mesh(folder / "mesh.ply"));
  EXPECT_LE(reference.max_error, options.tolerance);
  EXPECT_LE(result.figures.max, options.tolerance);
  std::filesystem::remove_all(folder);
}

INSTANTIATE_TEST_SUITE_P(Scenes, EveryScene, ::testing::ValuesIn(all_cases()), [](auto const& info) {
  Case const& c = info.param;
  return std::string(c.scene.name) + (c.perspective ? "_perspective_" : "_orthographic_") +
         std::to_string(int(std::lround(c.tolerance * 10000))) + (c.noise > 0 ? "_noisy" : "_exact");
});

TEST(MeshRangeImage, CoversEveryObjectPixelWhereNothingIsGrazing) {
  Camera const camera = small_camera();
  for (auto const& depth : {tilted_plane, wedge_with_step, stairs, waves}) {
    RangeImage const image = depth_map(camera, 1e-3, [&](int x, int y) { return depth(camera, x, y); });
    ViewMeshResult const result = mesh(image);
    EXPECT_EQ(result.figures.uncovered, 0);
    EXPECT_EQ(reference_raster(image, result.view_mesh.mesh).uncovered, 0u);
  }
}

TEST(MeshRangeImage, APlaneIsTwoTriangles) {
  for (bool perspective : {true, false}) {
    Camera const camera = perspective ? small_camera() : small_orthographic();
    for (Eigen::Vector3d const& normal : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(0.4, -0.7, 1)}) {
      RangeImage const image =
          depth_map(camera, 1e-3, [&](int x, int y) { return plane_depth(camera, normal, 2, x, y); });
      EXPECT_EQ(mesh(image).figures.triangles, 2u);
    }
  }
}

TEST(MeshRangeImage, NoTriangleSpansAStep) {
  Camera const camera = small_camera();
  // The ground rises slowly behind a disc that stands half a unit before it.
  auto const depth = [](int x, int y) { return std::hypot(x - 45, y - 38) < 20.3 ? 2.0 : 2.5 + 0.002 * y; };
  RangeImage const image = depth_map(camera, 1e-3, depth);
  ViewMeshResult const result = mesh(image);
  for (Eigen::Vector3i const& t : result.view_mesh.mesh.triangles) {
    float low = INFINITY, high = 0;
    for (int i = 0; i < 3; ++i) {
      low = std::min(low, result.view_mesh.mesh.vertices[t[i]].z());
      high = std::max(high, result.view_mesh.mesh.vertices[t[i]].z());
    }
    EXPECT_FALSE(low < 2.25 && high > 2.25);
  }
  EXPECT_EQ(result.figures.uncovered, 0);
  EXPECT_LT(result.figures.triangles, 300u);
}

TEST(MeshRangeImage, TheTrianglesOfASphereGrowAsTheInverseOfTheTolerance) {
  // Piecewise linear approximation of a smooth surface: error ~ 1 / triangles. Inside the disc where nothing is steep.
  Camera const camera = small_camera(256, 256);
  RangeImage const image = depth_map(camera, 1e-4, [&](int x, int y) {
    return std::hypot(x - 127.5, y - 127.5) < 28 ? sphere_depth(camera, {0, 0, 3}, 1, x, y) : kNaN;
  });
  double const coarse = double(mesh(image, within_units(4e-3)).figures.triangles);
  double const fine = double(mesh(image, within_units(5e-4)).figures.triangles);
  EXPECT_GT(fine / coarse, 2);
  EXPECT_LT(fine / coarse, 16);
}

/// RMS over the pixels of how far the mesh is from a surface, in depth.
double rms_to(RangeImage image, ViewMeshResult const& result, std::function<double(int, int)> const& truth) {
  image.depth = image.depth.clone();
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x)
      if (image.has_depth(x, y)) image.depth(y, x) = float(truth(x, y));
  ReferenceRaster const reference = reference_raster(image, result.view_mesh.mesh);
  return std::sqrt(reference.squares / double(reference.object - reference.uncovered));
}

TEST(AutomaticTolerance, DoesNotModelNoise) {
  Camera const camera = small_camera(320, 240);
  double const sigma = 0.002;
  auto const truth = [&](int x, int y) { return plane_depth(camera, {0.3, 0.2, 1}, 2, x, y); };
  RangeImage const image =
      depth_map(camera, sigma, [&](int x, int y) { return truth(x, y) + sigma * normal_noise(3, x, y); });
  ViewMeshResult const result = mesh(image);
  // A plane is two triangles; where noise alone makes a vertex worth having (1 of 70 tries), a few more.
  EXPECT_LE(result.figures.triangles, 20u);
  EXPECT_LE(reference_raster(image, result.view_mesh.mesh).max_over_sigma, result.tolerance);
  // p numbers fitted to n pixels are off by sigma √(p / n): 12 vertices, 76800 pixels, twice that.
  EXPECT_LE(rms_to(image, result, truth), 2 * sigma * std::sqrt(12.0 / 76800));
}

TEST(AutomaticTolerance, AveragesNoiseAwayAndIsNearTheBestOfAllTolerances) {
  Camera const camera = small_camera(240, 180);
  auto const truth = [&](int x, int y) { return waves(camera, x, y); };
  for (double const sigma : {0.001, 0.004, 0.016}) {
    SCOPED_TRACE(sigma);
    RangeImage const image =
        depth_map(camera, sigma, [&](int x, int y) { return truth(x, y) + sigma * normal_noise(3, x, y); });
    double const automatic = rms_to(image, mesh(image), truth);
    EXPECT_LT(automatic, sigma);
    MeshOptions options;
    options.tolerance_kind = MeshOptions::Tolerance::sigmas;
    double best = INFINITY;
    for (options.tolerance = 1.5; options.tolerance < 20; options.tolerance *= 1.4)
      best = std::min(best, rms_to(image, mesh(image, options), truth));
    EXPECT_LE(automatic, 1.1 * best);
  }
}

TEST(MeshRangeImage, StopsAtTheLimitOfTrianglesWithAllPixelsCovered) {
  Camera const camera = small_camera();
  RangeImage const image = depth_map(camera, 1e-3, [&](int x, int y) { return waves(camera, x, y); });
  MeshOptions options = within_units(1e-4);
  double error = INFINITY;
  for (int limit : {50, 200, 800}) {
    options.max_triangles = limit;
    ViewMeshResult const result = mesh(image, options);
    EXPECT_LE(result.figures.triangles, std::size_t(limit));
    EXPECT_GT(result.figures.triangles, std::size_t(limit) - 3);
    EXPECT_EQ(result.figures.uncovered, 0);
    EXPECT_LT(result.figures.rms, error);
    error = result.figures.rms;
  }
}

TEST(MeshRangeImage, GrazingTrianglesAreDroppedAndCounted) {
  // A plane whose normal is 85 degrees from the axis beside one that faces the camera.
  Camera const camera = small_orthographic();
  double const slope = std::tan(85 * std::numbers::pi / 180) * 0.01;  // units a pixel
  RangeImage const image = depth_map(camera, 1e-3, [&](int x, int) { return x < 48 ? 5.0 : 5.0 + slope * (x - 47.5); });
  MeshOptions options;
  options.max_angle_deg = 80;
  ViewMeshResult const result = mesh(image, options);
  EXPECT_NEAR(result.figures.uncovered, 0.5, 0.02);
  options.max_angle_deg = 88;
  EXPECT_EQ(mesh(image, options).figures.uncovered, 0);
  expect_sound(image, result);
}

TEST(MeshRangeImage, ASlopeIsNotPerforatedByItsNoise) {
  // 70 degrees, and noise of half a pixel's width: single small triangles are seen at more than 80.
  Camera const camera = small_orthographic();
  double const slope = std::tan(70 * std::numbers::pi / 180) * 0.01;
  RangeImage const image =
      depth_map(camera, 0.005, [&](int x, int y) { return 5 + slope * x + 0.005 * normal_noise(4, x, y); });
  MeshOptions options;
  options.tolerance_kind = MeshOptions::Tolerance::sigmas;
  options.tolerance = 1;
  EXPECT_LT(mesh(image, options).figures.uncovered, 0.005);
}

TEST(MeshRangeImage, GivesTheSameBytesAgain) {
  Camera const camera = small_camera();
  RangeImage const image =
      depth_map(camera, 0.002, [&](int x, int y) { return two_spheres(camera, x, y) + 0.002 * normal_noise(1, x, y); });
  ViewMeshResult const a = mesh(image), b = mesh(image);
  ASSERT_EQ(a.view_mesh.mesh.vertices, b.view_mesh.mesh.vertices);
  ASSERT_EQ(a.view_mesh.mesh.triangles, b.view_mesh.mesh.triangles);
  EXPECT_EQ(a.view_mesh.cos_phi, b.view_mesh.cos_phi);
}

TEST(MeshRangeImage, AMegapixelTakesAboutASecond) {
  Camera const camera = Camera::perspective(1024, 1024, 1000, 1000, 511.5, 511.5);
  RangeImage const image = depth_map(camera, 1e-3, [&](int x, int y) {
    return 3 + 0.1 * std::sin(x * 0.03) * std::cos(y * 0.02) + 1e-3 * normal_noise(5, x, y);
  });
  auto const start = std::chrono::steady_clock::now();
  ViewMeshResult const result = mesh(image);
  double const seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  RecordProperty("seconds", std::to_string(seconds));
  RecordProperty("triangles", int(result.figures.triangles));
  EXPECT_LE(result.figures.max, result.tolerance * 1e-3);
  EXPECT_LT(seconds, 30) << "generous: for slow and busy machines";
}

TEST(MeshRangeImage, CanBeCancelled) {
  std::atomic<bool> cancelled = true;
  Context context;
  context.cancelled = &cancelled;
  Camera const camera = small_camera();
  RangeImage const image = depth_map(camera, 1e-3, [&](int x, int y) { return waves(camera, x, y); });
  EXPECT_THROW(mesh_range_image(image, {}, context), Error);
}

TEST(MeshOptions, RefusesWhatMakesNoSense) {
  auto const refused = [](auto change) {
    MeshOptions options;
    change(options);
    EXPECT_THROW(options.validate(), Error);
  };
  refused([](MeshOptions& o) { o.tolerance_kind = MeshOptions::Tolerance::units, o.tolerance = 0; });
  refused([](MeshOptions& o) { o.tolerance_kind = MeshOptions::Tolerance::sigmas, o.tolerance = kNaN; });
  refused([](MeshOptions& o) { o.max_triangles = -1; });
  refused([](MeshOptions& o) { o.step_sigmas = 0; });
  refused([](MeshOptions& o) { o.max_angle_deg = 90.5; });
  refused([](MeshOptions& o) { o.feather_px = 0; });
  refused([](MeshOptions& o) { o.min_patch_pixels = 0; });
}

}  // namespace
}  // namespace scanview
