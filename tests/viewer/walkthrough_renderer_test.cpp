#include "viewer/walkthrough/walkthrough_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/error.h"
#include "tests/expect_error.h"
#include "viewer/rooms.h"

namespace scanview::test {
namespace {

using Eigen::Vector3d;

Vector3d within(double radius, CounterRandom& random) {
  return radius * std::cbrt(random.uniform()) * random_direction(random);
}

TEST(WalkthroughRenderer, AClosedRoomHasNoHoleWhereverOneLooks) {
  constexpr int kLooks = 1000;
  constexpr std::uint64_t kSeed = 20;
  struct {
    Surface scene;
    Vector3d node;
  } const cases[] = {{room(2, plain({0.5, 0.5, 0.5})), {0, 0, 0}},
                     {room(2, plain({0.5, 0.5, 0.5})), {0.3, -0.7, 0.4}},
                     {inside_of(slanted_walls(), plain({0.5, 0.5, 0.5})), {0.1, 0.05, -0.2}},
                     {globe({0.3, -0.2, 0.4}, 2, plain({0.5, 0.5, 0.5})), {0, 0, 0}}};
  for (auto const& [scene, node] : cases)
    for (int const most : {60, 15000}) {
      NodeMeshOptions options;
      options.max_triangles = most;
      options.walking_radius = 0.5;
      auto renderer = renderer_of({mesh_of(capture_cube(scene, node, 48), options)}, options.walking_radius);
      CounterRandom random(kSeed, std::uint64_t(most));
      std::size_t holes = 0;
      for (int i = 0; i < kLooks; ++i)
        holes += gaps(
            renderer.render(square_camera(32, 16), random_look(node + within(options.walking_radius, random), random)));
      EXPECT_EQ(holes, 0U) << most << " triangles, seed " << kSeed;
    }
}

TEST(WalkthroughRenderer, DepthsInAConvexRoomAreWithinTheParallax) {
  // Off by no more than e in 1/z at all pixel centres, a triangle's plane is off by up to 3 e between and beyond them
  // (one of two pixels across, continued by one). The point P' drawn, seen by the node in the depth z', is then
  // 3 e z' h from a wall at the distance h, and the eye's depth by 3 e z' h / |n d| off, d of length 1 along its axis.
  // Vertices drawn snap to 1/256 of a pixel: of f = 16 and a distance of 4 units, by 1e-3.
  NodeMeshOptions options;
  options.walking_radius = 0.5;
  int const size = 64;
  Vector3d const node(0.1, 0.05, -0.2);
  double const e = options.parallax_px / (0.5 * size * options.walking_radius);
  for (auto const& walls : {slanted_walls(), box_walls({-2, -1, -2.5}, {1.5, 1.5, 2})}) {
    Surface const scene = inside_of(walls, plain({0.5, 0.5, 0.5}));
    auto renderer = renderer_of({mesh_of(capture_cube(scene, node, size), options)}, options.walking_radius);
    CounterRandom random(31, 0);
    Camera const camera = square_camera(32, 16);
    std::size_t compared = 0;
    for (int look = 0; look < 200; ++look) {
      Eigen::Isometry3d const pose = random_look(node + within(options.walking_radius, random), random);
      Frame const frame = renderer.render(camera, pose);
      for (int y = 0; y < camera.height(); ++y)
        for (int x = 0; x < camera.width(); ++x) {
          Vector3d const d = pose.linear() * camera.ray_direction(x, y);
          Vector3d const drawn = pose.translation() + double(frame.depth(y, x)) * d - node;
          Vector3d const p = pose.translation() + true_depth(scene, camera, pose, x, y) * d;
          // Its wall; near an edge of the room, two pixels of the node's, the nearer of two is not decided.
          Wall const* on = nullptr;
          double least = INFINITY, second = INFINITY;
          for (Wall const& wall : walls) {
            double const off = wall.offset - wall.normal.dot(p);
            if (off < least) {
              second = least;
              least = off;
              on = &wall;
            } else {
              second = std::min(second, off);
            }
          }
          double const pixel = (p - node).norm() / (0.5 * size);
          if (second < 3 * pixel) continue;
          double const h = on->offset - on->normal.dot(node), slope = std::abs(on->normal.dot(d));
          double const bound = 3 * e * drawn.cwiseAbs().maxCoeff() * h / slope;
          ASSERT_LE(std::abs(frame.depth(y, x) - true_depth(scene, camera, pose, x, y)), bound + 1e-3 / slope)
              << "look " << look << " pixel " << x << ' ' << y;
          ++compared;
        }
    }
    EXPECT_GT(compared, 20000U);
  }
}

TEST(WalkthroughRenderer, FromTheCentreThePictureIsTheNodesResampled) {
  // Texels are bytes of s(c), s' at most 1.13 for light from 0.2 on. Bilinear between texels a step h = 1/f apart it is
  // off by h² / 8 of the second derivatives' sum; texels themselves by half a level and their 10 bits (0.13 of one);
  // the pixel by half a level again. Beside the sides' seams texels come resampled once more: twice, and a half.
  double const waves = 3, f = 32;
  double const second = 2 * 0.3 * (waves * waves + waves), bilinear = 255 * 1.13 * second / (8 * f * f);
  double const levels = 2 * bilinear + 0.5 + 0.5 + 0.5 + 0.2;
  Paint const paint = by_direction(waves);
  for (int const most : {60, 15000}) {
    NodeMeshOptions options;
    options.max_triangles = most;
    auto renderer = renderer_of(
        {mesh_of(capture_cube(globe({0.3, -0.2, 0.4}, 2, paint), Vector3d::Zero(), int(2 * f)), options)}, 1);
    Camera const camera = square_camera(48, 3 * f);  // nowhere coarser than the texels: no mip levels
    CounterRandom random(5, 0);
    double worst = 0;
    for (int look = 0; look < 100; ++look) {
      Eigen::Isometry3d const pose = random_look(Vector3d::Zero(), random);
      Frame const frame = renderer.render(camera, pose);
      for (int y = 0; y < camera.height(); ++y)
        for (int x = 0; x < camera.width(); ++x) {
          View const truth = node_side(globe(Vector3d::Zero(), 1, paint), camera.cropped(x, y, 1, 1), pose);
          for (int c = 0; c < 3; ++c)
            worst = std::max(worst, std::abs(double(frame.color(y, x)[c]) - truth.image.color(0, 0)[c]));
        }
    }
    // The truth is rounded too.
    EXPECT_LE(worst, levels + 0.5);
  }
}

/// A court: floor and four walls of 1 m, the sky above.
Surface court(Paint const& paint) {
  auto walls = box_walls({-3, -1, -3}, {3, 1, 3});
  Surface const all = inside_of(walls, paint);
  return [=](Vector3d const& origin, Vector3d const& direction) -> std::optional<Hit> {
    auto const hit = all(origin, direction);
    if (hit && (origin + hit->t * direction).y() > 1 - 1e-9) return std::nullopt;
    return hit;
  };
}

TEST(WalkthroughRenderer, TheSkyIsFarAndDoesNotMove) {
  double const waves = 3, f = 32, radius = 0.5;
  Paint const sky = by_direction(waves);
  Surface const scene = court(plain({0.3, 0.1, 0.1}));
  NodeMeshOptions options;
  options.walking_radius = radius;
  auto renderer = renderer_of({mesh_of(capture_cube(scene, Vector3d::Zero(), int(2 * f), sky), options)}, radius);
  // From the node's own point no crack shows between roof edges and sky.
  CounterRandom random(8, 0);
  for (int look = 0; look < 500; ++look)
    ASSERT_EQ(gaps(renderer.render(square_camera(48, 24), random_look(Vector3d::Zero(), random))), 0U);
  // The bound of the centre's picture, and a hundredth of a pixel's step of the paint.
  double const levels = 255 * 1.13 * (2 * 0.6 * (waves * waves + waves) / (8 * f * f) + 0.01 * 0.3 * waves / f) + 2.2;
  Camera const camera = square_camera(33, 3 * f);
  for (int look = 0; look < 50; ++look) {
    Vector3d const eye = within(radius, random);
    Eigen::Isometry3d const pose =
        look_at(eye, eye + Vector3d(0.3 * random.normal(), 1, 0.3 * random.normal()), Vector3d::UnitZ());
    Frame const frame = renderer.render(camera, pose);
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        Vector3d const d = pose.linear() * camera.ray_direction(x, y);
        if (d.normalized().y() < 0.8) continue;  // beside the walls
        // A hundred times as far as the farthest, along the side's axis; up to √3 less along another's.
        ASSERT_GT(frame.depth(y, x), 100 * 3 / std::sqrt(3.0));
        View const truth =
            node_side(globe(eye, 1, [&](Vector3d const& p) { return sky(p - eye); }), camera.cropped(x, y, 1, 1), pose);
        for (int c = 0; c < 3; ++c)
          ASSERT_LE(std::abs(double(frame.color(y, x)[c]) - truth.image.color(0, 0)[c]), levels);
      }
  }
}

TEST(WalkthroughRenderer, EyesOnEdgesAndCornersOfThePyramidsSeeTheWholeRoom) {
  auto renderer = renderer_of({mesh_of(capture_cube(room(2, by_direction(4)), Vector3d::Zero(), 48))}, 1);
  Camera const camera = square_camera(48, 24);
  for (Vector3d const& along : {Vector3d(1, 1, 0), Vector3d(0, -1, 1), Vector3d(1, 1, 1), Vector3d(-1, 1, -1)})
    for (double const at : {0.0, 0.25, 1.0})
      for (double const turn : {1.0, -1.0}) {
        Frame const frame =
            renderer.render(camera, look_at(at * along, at * along + turn * along, along.unitOrthogonal()));
        EXPECT_EQ(gaps(frame), 0U) << along.transpose() << " at " << at;
        for (float const z : cv::Mat1f(frame.depth)) ASSERT_TRUE(std::isfinite(z));
      }
}

TEST(WalkthroughRenderer, LeavingOutSidesChangesNoPixel) {
  // A picture and the same part of one so wide that its frustum meets all sides.
  Surface const walls = room(2, by_direction(4));
  Surface const objects = together({walls, sphere({0.8, 0.2, 0.5}, 0.3), sphere({-0.9, 0.5, -0.4}, 0.4)});
  constexpr int kLooks = 200, kSize = 24, kMargin = 300;
  cv::Rect const area(kMargin, kMargin, kSize, kSize);
  Camera const wide = square_camera(kSize + 2 * kMargin, 40);
  Camera const narrow = wide.cropped(kMargin, kMargin, kSize, kSize);
  for (bool const has_steps : {false, true}) {
    auto renderer = renderer_of({mesh_of(capture_cube(has_steps ? objects : walls, Vector3d::Zero(), 48))}, 1);
    CounterRandom random(12, 0);
    std::size_t left_out = 0;
    int differing = 0;
    for (int look = 0; look < kLooks; ++look) {
      Eigen::Isometry3d const pose = random_look(within(0.8, random), random);
      Frame const part = renderer.render(narrow, pose);
      left_out += kCubeSides - renderer.used()[0].sides;
      Frame const whole = renderer.render(wide, pose);
      cv::Mat4b const same = whole.color(area);
      for (int y = 0; y < kSize; ++y)
        for (int x = 0; x < kSize; ++x) differing += greatest_difference(part.color(y, x), same(y, x)) > 1;
    }
    EXPECT_GT(left_out, 400U) << "of " << kLooks * kCubeSides;
    // Places in single precision round differently in a wider picture: colours by a level at most, vertices to the next
    // 1/256 of a pixel, so that the two edges of a silhouette, the object's and the hole's behind it, of some 40 pixels
    // each, pass other centres, 80 / 256 a picture.
    EXPECT_LE(differing, has_steps ? kLooks * 80 / 256 : 0);
  }
}

TEST(WalkthroughRenderer, ALibraryWithoutNodesAndBadOptionsAreRefused) {
  EXPECT_SCANVIEW_ERROR(WalkthroughRenderer(make_node_library({}, 1), {}), ErrorCode::bad_input, "without nodes");
  auto const library = make_node_library({mesh_of(capture_cube(room(1, plain({1, 1, 1})), Vector3d::Zero(), 8))}, 1);
  auto const refused = [&](char const* name, auto set) {
    WalkthroughOptions options;
    set(options);
    EXPECT_SCANVIEW_ERROR(WalkthroughRenderer(library, options), ErrorCode::usage, name);
  };
  refused("merged", [](auto& o) { o.merged = 0; });
  refused("filling", [](auto& o) { o.filling = -1; });
  refused("depth_tolerance", [](auto& o) { o.depth_tolerance = NAN; });
  refused("parallax_tolerance_px", [](auto& o) { o.parallax_tolerance_px = -1; });
}

}  // namespace
}  // namespace scanview::test
