#include "acquire/captured_node.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "base/error.h"
#include "base/srgb.h"
#include "tests/expect_error.h"
#include "viewer/rooms.h"

namespace scanview::test {
namespace {

using Eigen::Vector3d;

CapturedNode one_side(Surface const& scene, Camera const& camera) {
  CapturedNode node{"000", Vector3d::Zero(), {}};
  node.sides.push_back(node_side(scene, camera, scene_from_cube_side(4, Vector3d::Zero())));
  return node;
}

TEST(HalfResolution, ColoursAreMeansOfLight) {
  CapturedNode node = one_side(room(2, plain({0, 0, 0})), square_camera(8, 4));
  cv::Mat3b& color = node.sides[0].image.color;
  CounterRandom random(1, 0);
  for (cv::Vec3b& c : color) c = {uchar(random.below(256)), uchar(255 * random.below(2)), uchar(random.below(256))};
  RangeImage const half = half_resolution(node).sides[0].image;
  auto const& linear = linear_from_srgb8();
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      for (int c = 0; c < 3; ++c) {
        double light = 0;
        for (int i = 0; i < 4; ++i) light += linear[color(2 * y + i / 2, 2 * x + i % 2)[c]] / 4;
        EXPECT_NEAR(half.color(y, x)[c], 255 * srgb_from_linear(light), 0.5 + 1e-6);
      }
}

TEST(HalfResolution, APlaneStaysThatPlane) {
  // 1/z is linear over the picture, so that the mean of four pixels is its value in their middle, for sizes that halve
  // evenly; 8 pixels' floats differ by their rounding. Slopes stay below 2 % a pixel.
  Surface const plane = inside_of({{Vector3d(0.2, -0.1, 1).normalized(), 2}}, plain({0.5, 0.5, 0.5}));
  CapturedNode const node = one_side(plane, Camera::perspective(64, 48, 60, 55, 30, 25));
  RangeImage const half = half_resolution(node).sides[0].image;
  half.check();
  for (int y = 0; y < half.depth.rows; ++y)
    for (int x = 0; x < half.depth.cols; ++x) {
      double const z = true_depth(plane, half.camera, *node.sides[0].object_from_camera, x, y);
      ASSERT_NEAR(half.depth(y, x), z, 4 * std::ldexp(z, -24));
    }
}

TEST(HalfResolution, OfOddSizesPixelsStayWhereTheyAre) {
  // The camera of half the size shows the whole picture; a depth may be off by what the plane's slope makes of the half
  // of a pixel that rounding to whole ones may cost it, not by what piles up towards the far edge.
  Surface const plane = inside_of({{Vector3d(0.2, -0.1, 1).normalized(), 2}}, plain({0.5, 0.5, 0.5}));
  for (auto const& size : {cv::Size(63, 47), cv::Size(9, 7), cv::Size(3, 3), cv::Size(1, 1), cv::Size(1, 5)}) {
    Camera const camera = Camera::perspective(size.width, size.height, 60, 55, 0.4 * size.width, 0.6 * size.height);
    CapturedNode const node = one_side(plane, camera);
    RangeImage const half = half_resolution(node).sides[0].image;
    half.check();
    for (int y = 0; y < half.depth.rows; ++y)
      for (int x = 0; x < half.depth.cols; ++x) {
        double const z = true_depth(plane, half.camera, *node.sides[0].object_from_camera, x, y);
        // 1/z falls by at most (0.2 / 60 + 0.1 / 55) / 2 a pixel of the finer picture along both axes.
        double const off = 0.5 * (0.2 / 60 + 0.1 / 55) / 2;
        EXPECT_NEAR(1 / double(half.depth(y, x)), 1 / z, off + 1e-6) << size << ' ' << x << ' ' << y;
      }
  }
}

TEST(HalfResolution, DepthsAreNeverBetweenTwoSurfaces) {
  Surface const scene = together({room(3, plain({0.5, 0.5, 0.5})), sphere({0.1, 0.2, 1.2}, 0.5)});
  CapturedNode node = one_side(scene, square_camera(64, 32));
  for (int level = 0; level < 3; ++level) {
    CapturedNode const half = half_resolution(node);
    RangeImage const& fine = node.sides[0].image;
    RangeImage const& coarse = half.sides[0].image;
    coarse.check();
    for (int y = 0; y < coarse.depth.rows; ++y)
      for (int x = 0; x < coarse.depth.cols; ++x) {
        // The nearest of the four, or up to 2 % behind it.
        float nearest = INFINITY;
        for (int i = 0; i < 4; ++i) nearest = std::min(nearest, fine.depth(2 * y + i / 2, 2 * x + i % 2));
        ASSERT_GE(coarse.depth(y, x), nearest * (1 - 1e-6F));
        ASSERT_LE(coarse.depth(y, x), nearest * 1.02F * (1 + 1e-6F));
      }
    node = half;
  }
}

TEST(HalfResolution, SkyAndMissingDepthsStayWhatTheyAre) {
  CapturedNode node = one_side(inside_of({{{0, -1, 0}, 1}}, plain({0.5, 0.5, 0.5})), square_camera(8, 4));
  RangeImage& image = node.sides[0].image;
  image.remove(0, 7, PixelClass::no_depth);
  RangeImage const half = half_resolution(node).sides[0].image;
  half.check();
  EXPECT_EQ(half.classes(0, 2), uchar(PixelClass::background));
  EXPECT_EQ(half.classes(3, 0), uchar(PixelClass::object));  // three of four have one
  for (auto const& [x, y] : {std::pair(1, 7), {0, 6}, {1, 6}}) image.remove(x, y, PixelClass::no_depth);
  EXPECT_EQ(half_resolution(node).sides[0].image.classes(3, 0), uchar(PixelClass::no_depth));
}

TEST(CapturedNode, SidesOfACubeCoverEveryDirectionOnce) {
  CounterRandom random(2, 0);
  Camera const camera = cube_side_camera(16);
  for (int i = 0; i < 1000; ++i) {
    Vector3d const direction = random_direction(random);
    int seen = 0;
    for (int side = 0; side < kCubeSides; ++side) {
      Eigen::Matrix3d const rotation = scene_from_cube_side(side, Vector3d::Zero()).linear();
      EXPECT_NEAR(rotation.determinant(), 1, 1e-15);
      Vector3d const p = rotation.transpose() * direction;
      seen += p.z() > 0 && camera.contains(camera.project(p));
    }
    EXPECT_EQ(seen, 1);
  }
  EXPECT_SCANVIEW_ERROR(cube_side_camera(0), ErrorCode::usage, "pixel");
}

TEST(CapturedNode, SidesWithSeveralEyesAreRefused) {
  CapturedNode node = one_side(room(2, plain({0.5, 0.5, 0.5})), square_camera(8, 4));
  EXPECT_NO_THROW(node.check());
  node.sides.push_back(
      node_side(room(2, plain({0.5, 0.5, 0.5})), square_camera(8, 4), look_at({0.1, 0, 0}, {1, 0, 0})));
  EXPECT_THROW(node.check(), std::logic_error);
  node.sides.clear();
  EXPECT_THROW(node.check(), std::logic_error);
}

}  // namespace
}  // namespace scanview::test
