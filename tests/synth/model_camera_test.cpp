#include "synth/model_camera.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <random>

#include "synth/scanner.h"
#include "tests/expect_error.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// A box seen from inside: its triangles face its middle. Some of its colours differ.
TriangleMesh make_room(Vector3d const& center, Vector3d const& half) {
  TriangleMesh mesh = make_cube();
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    mesh.vertices[i] = (center + half.cwiseProduct(mesh.vertices[i].cast<double>())).cast<float>();
    mesh.colors.emplace_back(static_cast<uchar>(40 + 20 * i), 128, static_cast<uchar>(250 - 20 * i));
  }
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

TriangleMesh joined(TriangleMesh a, TriangleMesh const& b) {
  auto const first = static_cast<int>(a.vertices.size());
  a.vertices.insert(a.vertices.end(), b.vertices.begin(), b.vertices.end());
  a.colors.insert(a.colors.end(), b.colors.begin(), b.colors.end());
  for (auto const& t : b.triangles) a.triangles.emplace_back(t + Eigen::Vector3i::Constant(first));
  return a;
}

/// Depth along a ray of z = 1 that starts inside a box.
double box_depth(Vector3d const& eye, Vector3d const& direction, Eigen::AlignedBox3d const& box) {
  double depth = INFINITY;
  for (int axis = 0; axis < 3; ++axis)
    if (direction[axis] != 0)
      depth = std::min(depth, ((direction[axis] > 0 ? box.max() : box.min())[axis] - eye[axis]) / direction[axis]);
  return depth;
}

bool same_bytes(cv::Mat const& a, cv::Mat const& b) {
  return a.size() == b.size() && a.type() == b.type() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

void expect_same(CapturedNode const& a, CapturedNode const& b) {
  for (int side = 0; side < kCubeSides; ++side) {
    EXPECT_TRUE(same_bytes(a.sides[side].image.depth, b.sides[side].image.depth)) << side;
    EXPECT_TRUE(same_bytes(a.sides[side].image.color, b.sides[side].image.color)) << side;
    EXPECT_TRUE(same_bytes(a.sides[side].image.classes, b.sides[side].image.classes)) << side;
  }
}

ModelCameraOptions painted() {
  ModelCameraOptions options;
  options.light = ModelCameraOptions::Light::painted;
  return options;
}

TEST(ModelCamera, DepthsOnAllCubeSidesArePlaneExactAlsoFarFromTheOrigin) {
  for (Vector3d const& center : {Vector3d(0, 0, 0), Vector3d(1, 2, 3), Vector3d(1048576, 0.5, -2097152)}) {
    Vector3d const half(4, 2, 3), eye = center + Vector3d(1.3, -0.4, 2.1);
    Context context;
    ModelCamera camera(make_room(center, half), painted(), context);
    CapturedNode const node = capture_node(camera, eye, 33, "000", context);
    ASSERT_EQ(node.sides.size(), std::size_t{kCubeSides});
    Eigen::AlignedBox3d const box(center - half, center + half);
    for (View const& side : node.sides)
      for (int y = 0; y < 33; ++y)
        for (int x = 0; x < 33; ++x) {
          Vector3d const direction = side.object_from_camera->linear() * side.image.camera.ray_direction(x, y);
          double const expected = box_depth(eye, direction, box);
          ASSERT_TRUE(side.image.has_depth(x, y));
          EXPECT_NEAR(side.image.depth(y, x), expected, 1e-7 * expected) << side.name << " " << x << " " << y;
        }
  }
}

TEST(ModelCamera, SidesOfACubeAgreeAlongTheEdgeTheyShare) {
  Context context;
  ModelCamera camera(make_room({0, 0, 0}, {4, 2, 3}), painted(), context);
  int const size = 64;
  CapturedNode const node = capture_node(camera, {1.3, -0.4, 0.6}, size, "000", context);
  // 1 / depth is linear in the picture of a plane; on the cube's edge both sides have the same depth.
  auto const at_edge = [&](RangeImage const& image, int y, int inwards, int x) {
    return 1.5 / image.depth(y, x) - 0.5 / image.depth(y, x + inwards);
  };
  RangeImage const &ahead = node.sides[4].image, &right = node.sides[1].image;  // +z; -x is on its right
  int compared = 0;
  for (int y = 0; y < size; ++y) {
    double const a = at_edge(ahead, y, -1, size - 1), b = at_edge(right, y, 1, 0);
    Vector3d const ray = node.sides[4].object_from_camera->linear() * ahead.camera.ray_direction(size - 0.5, y);
    double const expected = 1 / box_depth(node.position, ray, {Vector3d(-4, -2, -3), Vector3d(4, 2, 3)});
    if (std::abs(a - expected) > 1e-3 || std::abs(b - expected) > 1e-3) continue;  // a room's edge lies between
    EXPECT_NEAR(a, b, 3e-7);
    ++compared;
  }
  EXPECT_GT(compared, size * 9 / 10);
}

TEST(ModelCamera, DepthsOfOneToAMillionAreBothExact) {
  TriangleMesh model;  // a wall of 2 mm, 1 mm before the eye, and one of 4 km at 1 km
  Vector3d const eye(0.5, 1.5, 0.25);
  float const near_z = 0.251f, far_z = 1000;
  for (auto const& [half, z] : {std::pair{0.001f, near_z}, std::pair{2000.f, far_z}}) {
    auto const first = static_cast<int>(model.vertices.size());
    for (auto const& [x, y] : {std::pair{-1.f, -1.f}, {1.f, -1.f}, {1.f, 1.f}, {-1.f, 1.f}})
      model.vertices.emplace_back(0.5f + half * x, 1.5f + half * y, z);
    model.triangles.emplace_back(first, first + 2, first + 1);
    model.triangles.emplace_back(first, first + 3, first + 2);
  }
  Context context;
  ModelCamera camera(model, painted(), context);
  Isometry3d const pose = scene_from_cube_side(4, eye);
  RangeImage const image =
      camera.capture(Camera::perspective(256, 256, 64, 64, 127.5, 127.5), pose, context);  // 127° wide
  int near_count = 0;
  for (int y = 0; y < 256; ++y)
    for (int x = 0; x < 256; ++x) {
      double const off = std::max(std::abs(x - 127.5), std::abs(y - 127.5)) / 64;  // of the ray, at depth 1
      double const edge = (1e-3 / (near_z - eye.z()));
      if (std::abs(off - edge) < 1e-3) continue;
      double const expected = off < edge ? near_z - eye.z() : far_z - eye.z();
      near_count += off < edge;
      ASSERT_TRUE(image.has_depth(x, y));
      EXPECT_NEAR(image.depth(y, x), expected, 1e-7 * expected);
    }
  EXPECT_GT(near_count, 10000);
}

TEST(ModelCamera, ANodeInsideAnObjectIsRefused) {
  Context context;
  ModelCamera camera(make_icosphere({3, 0, 0}, 1, 3), {}, context);
  EXPECT_SCANVIEW_ERROR(capture_node(camera, {3.25, 0.5, 0}, 8, "000", context), ErrorCode::bad_input,
                        "(3.25, 0.5, 0)");
  EXPECT_GT(camera.share_of_backs({3.25, 0.5, 0}), 0.99);
  EXPECT_EQ(camera.share_of_backs({0, 0, 0}), 0);
  EXPECT_NEAR(camera.clearance({3, 0, 0}), 1, 0.02);
  EXPECT_NEAR(camera.clearance({0, 0, 0}), 2, 0.05);
  ModelCamera room(make_room({0, 0, 0}, {1, 1, 1}), {}, context);
  EXPECT_EQ(room.share_of_backs({0.2, 0.1, 0}), 0);
  EXPECT_EQ(room.clearance({0, 0, 1e4}), INFINITY) << "so far away that no direction meets it";
}

TEST(ModelCamera, LightDoesNotDependOnTheOrderOfPicturesNorOnThreads) {
  TriangleMesh model = joined(make_room({0, 0, 0}, {4, 2, 3}), make_icosphere({-2, 0, 0}, 0.7, 4));
  model.colors.resize(model.vertices.size(), cv::Vec3b(200, 220, 240));
  model.triangles.erase(model.triangles.begin() + 6, model.triangles.begin() + 8);  // open above
  Vector3d const a(1, 0, 0), b(-1, 0.5, 1);
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  ModelCamera forth(model, {}, one), back(model, {}, two);
  CapturedNode const first = capture_node(forth, a, 40, "a", one), second = capture_node(forth, b, 40, "b", one);
  cv::Mat3b const preview =
      back.picture(cube_side_camera(16), scene_from_cube_side(1, Vector3d(0.5, 0.1, 0.2)), two);  // lights a part
  CapturedNode const second_again = capture_node(back, b, 40, "b", two),
                     first_again = capture_node(back, a, 40, "a", two);
  expect_same(first, first_again);
  expect_same(second, second_again);
  EXPECT_GT(cv::countNonZero(preview.reshape(1)), 0);
}

TEST(ModelCamera, PaintedColoursAreTheModels) {
  TriangleMesh model = make_room({0, 0, 0}, {1, 1, 1});
  for (auto& color : model.colors) color = {10, 99, 250};
  Context context;
  ModelCamera camera(model, painted(), context);
  CapturedNode const node = capture_node(camera, {0.1, 0.2, 0.3}, 16, "000", context);
  for (View const& side : node.sides)
    for (cv::Vec3b const& color : side.image.color) EXPECT_EQ(color, cv::Vec3b(10, 99, 250));
}

TEST(ModelCamera, PicturesHaveTheColoursOfCapturesAndSoftEdgesAgainstTheSky) {
  Context context;
  for (int const samples_side : {1, 3, 4, 6}) {
    ModelCameraOptions options;
    options.samples_side = samples_side;
    ModelCamera camera(make_icosphere({0, 0, 5}, 1, 3), options, context);
    Camera const lens = Camera::perspective(60, 50, 100, 100, 29.5, 24.5);
    RangeImage const image = camera.capture(lens, Isometry3d::Identity(), context);
    cv::Mat3b const picture = camera.picture(lens, Isometry3d::Identity(), context);
    int backgrounds = 0, mixed = 0;
    for (int y = 0; y < 50; ++y)
      for (int x = 0; x < 60; ++x) {
        if (image.has_depth(x, y)) {
          EXPECT_EQ(image.color(y, x), picture(y, x));
          continue;
        }
        ++backgrounds;
        EXPECT_EQ(image.classes(y, x), static_cast<uchar>(PixelClass::background));
        EXPECT_EQ(image.color(y, x), cv::Vec3b(0x80, 0x6e, 0x60));
        mixed += picture(y, x) != image.color(y, x);
      }
    EXPECT_GT(backgrounds, 1000);
    EXPECT_EQ(mixed > 0, samples_side > 1);
  }
}

TEST(ModelCamera, SeesWhatTheScannerSees) {
  Context context;
  TriangleMesh const model = make_icosphere({10, 20, 30}, 40, 3);
  SynthOptions synth;
  synth.views = 2;
  synth.width = synth.height = 64;
  SynthResult const truth = synthesize(model, synth, context);
  ModelCamera camera(model, {}, context);
  for (int v = 0; v < 2; ++v) {
    RangeImage const image = camera.capture(truth.set.views[v].image.camera, truth.true_poses[v], context);
    EXPECT_EQ(image.count_depths(), truth.set.views[v].image.count_depths());
    for (int y = 0; y < 64; ++y)
      for (int x = 0; x < 64; ++x)
        if (image.has_depth(x, y)) {
          EXPECT_NEAR(image.depth(y, x), truth.true_depth[v](y, x), 1e-3) << "but for the silhouette, within rounding";
        }
  }
}

TEST(ModelCamera, BadOptionsAndCamerasAreRefused) {
  Context context;
  auto const refused = [&](auto&& change, char const* field) {
    ModelCameraOptions options;
    change(options);
    EXPECT_SCANVIEW_ERROR(ModelCamera(make_cube(), options, context), ErrorCode::usage, field);
  };
  refused([](auto& o) { o.samples_side = 0; }, "samples_side");
  refused([](auto& o) { o.background = "blue"; }, "blue");
  refused([](auto& o) { o.surface.directions = 100; }, "surface.directions");
  refused([](auto& o) { o.surface.exposure = NAN; }, "surface.exposure");
  refused([](auto& o) { o.surface.fill = 2; }, "surface.fill");
  refused([](auto& o) { o.surface.fill_reach = 0; }, "surface.fill_reach");
  EXPECT_SCANVIEW_ERROR(ModelCamera(TriangleMesh{}, {}, context), ErrorCode::bad_input, "without triangles");
  ModelCamera camera(make_cube(), {}, context);
  EXPECT_SCANVIEW_ERROR(camera.capture(Camera::orthographic(8, 8, 1, 1, 4, 4), Isometry3d::Identity(), context),
                        ErrorCode::usage, "perspective");
}

}  // namespace
}  // namespace scanview
