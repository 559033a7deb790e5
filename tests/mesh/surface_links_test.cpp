#include "mesh/surface_links.h"

#include <gtest/gtest.h>

#include <numbers>

#include "tests/mesh/depth_maps.h"

namespace scanview {
namespace {

using namespace testing;

std::size_t missing_links(SurfaceLinks const& links) {
  std::size_t count = 0;
  for (int y = 0; y < links.object.rows; ++y)
    for (int x = 0; x < links.object.cols; ++x) {
      count += links.is_object(x, y) && links.is_object(x + 1, y) && !links.right(y, x);
      count += links.is_object(x, y) && links.is_object(x, y + 1) && !links.down(y, x);
    }
  return count;
}

TEST(SurfaceLinks, APlaneAtAnyAngleHasNoStep) {
  for (double degrees : {0, 45, 70, 80, 85, 89}) {
    SCOPED_TRACE(degrees);
    double const t = std::tan(degrees * std::numbers::pi / 180);
    Camera const orthographic = small_orthographic(), perspective = small_camera();
    auto const flat = [&](int x, int y) { return 5 + 0.01 * t * (0.8 * x + 0.6 * y); };
    EXPECT_EQ(missing_links(find_surface_links(depth_map(orthographic, 1e-5, flat), 6, 1)), 0u);
    for (Eigen::Vector3d const& normal : {Eigen::Vector3d(-t, 0, 1), Eigen::Vector3d(0, t, 1)}) {
      auto const seen = [&](int x, int y) {
        double const z = plane_depth(perspective, normal, 5, x, y);
        return z < 100 ? z : std::numeric_limits<double>::quiet_NaN();
      };
      EXPECT_EQ(missing_links(find_surface_links(depth_map(perspective, 1e-5, seen), 6, 1)), 0u);
    }
  }
}

TEST(SurfaceLinks, NoiseMakesNoSteps) {
  // A link of a level plane is cut beyond 6 sqrt(2) sigma: never.
  auto const level = [](int x, int y) { return 2 + 0.05 * normal_noise(9, x, y); };
  EXPECT_EQ(missing_links(find_surface_links(depth_map(small_camera(), 0.05, level), 6, 1)), 0u);
}

TEST(SurfaceLinks, AStepIsFoundAllAlong) {
  Camera const camera = small_camera();
  auto const depth = [&](int x, int y) {
    return plane_depth(camera, {0.2, 0.1, 1}, 2, x, y) - (x > 40 ? 0.3 : 0) + 0.002 * normal_noise(1, x, y);
  };
  SurfaceLinks const links = find_surface_links(depth_map(camera, 0.002, depth), 6, 1);
  EXPECT_EQ(missing_links(links), std::size_t(camera.height()));
  for (int y = 0; y < camera.height(); ++y) EXPECT_EQ(links.right(y, 40), 0);
}

TEST(SurfaceLinks, AStepOnASteepPlaneIsFound) {
  // 80 degrees: 5.7 pixels' widths of depth a pixel; a step of thirty is more than twice the slope.
  Camera const camera = small_orthographic();
  double const slope = 0.01 * std::tan(80 * std::numbers::pi / 180);
  auto const depth = [&](int x, int) { return 5 + slope * x + (x > 40 ? 0.3 : 0); };
  SurfaceLinks const links = find_surface_links(depth_map(camera, 1e-4, depth), 6, 1);
  EXPECT_EQ(missing_links(links), std::size_t(camera.height()));
}

TEST(SurfaceLinks, SteepCrestsAndTipsAreWhole) {
  Camera const camera = small_orthographic();
  for (double slope : {0.02, -0.05}) {  // 63 and 79 degrees at pixels of 0.01
    auto const crest = [&](int x, int) { return 5 + slope * std::abs(x - 40.0); };
    EXPECT_EQ(missing_links(find_surface_links(depth_map(camera, 1e-5, crest), 6, 1)), 0u);
    auto const tip = [&](int x, int y) { return 5 + slope * std::hypot(x - 40.3, y - 40); };
    EXPECT_EQ(missing_links(find_surface_links(depth_map(camera, 1e-5, tip), 6, 1)), 0u);
  }
}

TEST(SurfaceLinks, PixelsThatFlyBetweenTwoSurfacesBelongToNeither) {
  auto const depth = [](int x, int) { return x < 40 ? 2.0 : x == 40 ? 2.4 : 3.0; };
  SurfaceLinks const links = find_surface_links(depth_map(small_camera(), 1e-3, depth), 6, 1);
  for (int y = 0; y < 80; ++y) {
    EXPECT_EQ(links.right(y, 39), 0);
    EXPECT_EQ(links.right(y, 40), 0);
  }
}

TEST(SurfaceLinks, SmallPatchesAreDroppedAndCounted) {
  auto const depth = [](int x, int y) {
    if (x == 20 && y == 20) return 1.0;            // one pixel
    if (y == 40 && x >= 30 && x < 33) return 1.0;  // three
    if (y == 60 && x >= 30 && x < 34) return 1.0;  // four stay
    return 2.0;
  };
  SurfaceLinks const links = find_surface_links(depth_map(small_camera(), 1e-3, depth), 6, 4);
  EXPECT_EQ(links.dropped, 4u);
  EXPECT_FALSE(links.is_object(20, 20));
  EXPECT_FALSE(links.is_object(31, 40));
  EXPECT_TRUE(links.is_object(31, 60));
}

}  // namespace
}  // namespace scanview
