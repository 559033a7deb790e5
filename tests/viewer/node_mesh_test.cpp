#include "mesh/node_mesh.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "base/error.h"
#include "tests/expect_error.h"
#include "viewer/rooms.h"

namespace scanview::test {
namespace {

using Eigen::Vector3d;

Vector3d center_of(NodeMesh const& mesh, std::size_t t) {
  Vector3d sum = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) sum += mesh.vertices[mesh.triangles[t][i]].cast<double>();
  return sum / 3;
}

/// Of the triangles' corners, along the axis of their side.
std::pair<double, double> depths_of(NodeMesh const& mesh, NodeMesh::Side const& side, std::size_t t) {
  double low = INFINITY, high = 0;
  for (int i = 0; i < 3; ++i) {
    double const z = side.node_from_camera.col(2).dot(mesh.vertices[mesh.triangles[t][i]].cast<double>());
    low = std::min(low, z);
    high = std::max(high, z);
  }
  return {low, high};
}

TEST(NodeMesh, QualityOfATriangleIsTheCosineOfItsWall) {
  double const half = 2;
  NodeMesh const mesh = mesh_of(capture_cube(room(half, plain({0.5, 0.5, 0.5})), Vector3d::Zero(), 32));
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    // Towards a point p of the wall the normal is the axis of p's greatest coordinate. Seams and edges of the cube
    // coincide with those of the room, so that every triangle is of one wall.
    Vector3d const p = center_of(mesh, t);
    double const cosine = p.cwiseAbs().maxCoeff() / p.norm();
    // Vertices off by the parallax's share of a depth tilt a small triangle: here planes are exact to rounding, 2^-24
    // of the coordinates over edges of at least half a pixel, 1/32 of them.
    EXPECT_NEAR(mesh.quality[t], cosine, 2 * 32 * std::ldexp(4.0, -24)) << p.transpose();
  }
  for (float const q : mesh.smooth_quality()) {
    EXPECT_GT(q, 1 / std::sqrt(3.0) - 1e-3);  // at the room's corners
    EXPECT_LE(q, 1);
  }
}

TEST(NodeMesh, AWallAMillimetreAwayAndOneOfThreeMetres) {
  Surface const scene = inside_of(box_walls({-3, -3, -3}, {0.001, 3, 3}), by_direction(5));
  CapturedNode const node = capture_cube(scene, Vector3d::Zero(), 64);
  NodeMesh const mesh = mesh_of(node);
  for (auto const& v : mesh.vertices) ASSERT_TRUE(v.allFinite());
  auto renderer = renderer_of({mesh}, 1);
  for (View const& side : node.sides) {
    Frame const frame = renderer.render(side.image.camera, *side.object_from_camera);
    EXPECT_EQ(gaps(frame), 0U) << side.name;
    for (int y = 0; y < frame.color.rows; ++y)
      for (int x = 0; x < frame.color.cols; ++x) {
        // Texels in 10 bits of the root of light keep sRGB bytes to a level.
        for (int c = 0; c < 3; ++c)
          ASSERT_LE(std::abs(frame.color(y, x)[c] - side.image.color(y, x)[c]), 1) << side.name << ' ' << x << ' ' << y;
      }
  }
}

TEST(NodeMesh, TheErrorOfEveryPixelIsWithinTheParallax) {
  // The displacement of a pixel in a picture with the side's axes, for an eye moved by m across them, is f m |Δ(1/z)|.
  for (double const parallax : {0.25, 1.0}) {
    NodeMeshOptions options;
    options.max_triangles = 0;
    options.parallax_px = parallax;
    options.walking_radius = 0.5;
    Surface const scene = globe({0.3, -0.2, 0.4}, 2, plain({0.5, 0.5, 0.5}));
    CapturedNode const node = capture_cube(scene, Vector3d::Zero(), 64);
    NodeMesh const mesh = mesh_of(node, options);
    EXPECT_LE(mesh.parallax_px, parallax);
    auto renderer = renderer_of({mesh}, options.walking_radius);
    for (View const& side : node.sides) {
      Camera const& camera = side.image.camera;
      Frame const frame = renderer.render(camera, *side.object_from_camera);
      for (int y = 0; y < frame.depth.rows; ++y)
        for (int x = 0; x < frame.depth.cols; ++x) {
          double const off = std::abs(1 / double(frame.depth(y, x)) - 1 / double(side.image.depth(y, x)));
          // Vertices snap to 1/256 pixel when drawn: of a slope of 1/z, at most 1 / (z_min f) a pixel or so, 1/f here.
          double const snapped = 2.0 / 256 / camera.fx();
          ASSERT_LE(off, parallax / (camera.fx() * options.walking_radius) + snapped) << x << ' ' << y;
        }
    }
  }
}

TEST(NodeMesh, FewTrianglesAreNotExceeded) {
  Surface const scene = globe({0.3, -0.2, 0.4}, 2, plain({0.5, 0.5, 0.5}));
  CapturedNode const node = capture_cube(scene, Vector3d::Zero(), 64);
  NodeMeshOptions options;
  options.parallax_px = 0.01;
  for (int const most : {200, 500, 1500}) {
    options.max_triangles = most;
    NodeMesh const mesh = mesh_of(node, options);
    EXPECT_LE(int(mesh.triangles.size()), most);
    EXPECT_GT(int(mesh.triangles.size()), most / 2) << "errors above the limit, but triangles are left";
  }
}

TEST(NodeMesh, EqualForAnyNumberOfThreads) {
  Surface const scene = together({globe({0.3, -0.2, 0.4}, 2, by_direction(4)), sphere({0.5, 0.5, 0.6}, 0.3)});
  CapturedNode const node = capture_cube(scene, Vector3d::Zero(), 48);
  NodeMeshOptions options;
  options.max_triangles = 800;
  for (auto const placement : {NodeMeshOptions::Placement::insertion, NodeMeshOptions::Placement::probing}) {
    options.placement = placement;
    Context one, several;
    one.threads = 1;
    several.threads = 7;
    NodeMesh const a = mesh_node(node, options, one), b = mesh_node(node, options, several);
    EXPECT_EQ(a.vertices, b.vertices);
    EXPECT_EQ(a.triangles, b.triangles);
    EXPECT_EQ(a.quality, b.quality);
  }
}

/// A column of a pixel and a half of the side towards -z, near its middle, before a wall.
Surface thin_column() {
  double const width = 1.5 * 0.5 / 32;  // at a depth of ½, of f = 32
  return together({room(3, plain({0.2, 0.6, 0.2})),
                   solid_box({0.05, -2.9, -0.52}, {0.05 + width, 2.9, -0.5}, plain({0.8, 0.1, 0.1}))});
}

TEST(NodeMesh, AHairThinColumnStandsAlone) {
  CapturedNode const node = capture_cube(thin_column(), Vector3d::Zero(), 64);
  for (auto const placement : {NodeMeshOptions::Placement::insertion, NodeMeshOptions::Placement::probing})
    for (auto const silhouettes : {NodeMeshOptions::Silhouettes::constrained, NodeMeshOptions::Silhouettes::torn}) {
      NodeMeshOptions options;
      options.placement = placement;
      options.silhouettes = silhouettes;
      NodeMesh const mesh = mesh_of(node, options);
      bool const is_torn = silhouettes == NodeMeshOptions::Silhouettes::torn;
      std::size_t of_column = 0;
      for (NodeMesh::Side const& side : mesh.sides)
        for (std::size_t t = side.first; t < side.end; ++t) {
          auto const [low, high] = depths_of(mesh, side, t);
          // The room is the same cube as the sides' pyramids: the wall is at 3 everywhere, the column in front of 0.6
          // where its own side sees it, and up to 2.9 away along itself.
          if (side.node_from_camera.col(2).z() < -0.5) {
            EXPECT_TRUE(high < 0.6 || low > 2.9)
                << low << " to " << high << (is_torn ? " torn" : "") << " placement " << int(placement);
            of_column += high < 0.6;
          }
        }
      EXPECT_TRUE(is_torn || of_column > 0);
    }
}

TEST(NodeMesh, AHairThinColumnIsSeenAndNothingHangsOnIt) {
  CapturedNode const node = capture_cube(thin_column(), Vector3d::Zero(), 64);
  View const& side = node.sides[5];  // towards -z
  auto renderer = renderer_of({mesh_of(node)}, 1);
  Frame const centre = renderer.render(side.image.camera, *side.object_from_camera);
  std::size_t of_column = 0;
  for (int y = 0; y < centre.depth.rows; ++y)
    for (int x = 0; x < centre.depth.cols; ++x) {
      bool const is_column = side.image.depth(y, x) < 0.6;
      of_column += is_column;
      EXPECT_EQ(centre.depth(y, x) < 0.6, is_column) << x << ' ' << y;
    }
  EXPECT_GE(of_column, 64U);
  // From elsewhere each sample is of the column, of the wall, or missing: the column's depth from the eye is 0.5 ± 0.2.
  for (Vector3d const& eye : {Vector3d(0.2, 0, 0), Vector3d(-0.2, 0.1, 0.1), Vector3d(0.05, 0.05, 0.2)}) {
    Frame const frame = renderer.render(square_camera(96, 48), look_at(eye, eye - Vector3d::UnitZ()));
    for (float const z : cv::Mat1f(frame.depth)) EXPECT_TRUE(std::isnan(z) || z < 0.75 || z > 2.75) << z;
  }
}

TEST(NodeMesh, DepthsFromOneToAMillionInOneNode) {
  // A floor a unit below the eye, a wall at a million, a ball at one.
  Surface const scene =
      together({inside_of(box_walls({-1e6, -1, -1e6}, {1e6, 1e6, 1e6}), by_direction(6)), sphere({0, 0, -2}, 1)});
  CapturedNode const node = capture_cube(scene, Vector3d::Zero(), 64);
  NodeMesh const mesh = mesh_of(node);
  auto renderer = renderer_of({mesh}, 1);
  CounterRandom random(9, 0);
  for (int i = 0; i < 100; ++i)
    EXPECT_EQ(gaps(renderer.render(square_camera(48, 24), random_look({0, 0, 0}, random))), 0U);
  // The ball is still there for an eye half a unit from it, and at its depth.
  Frame const near = renderer.render(square_camera(9, 9), look_at({0, 0, -0.5}, {0, 0, -2}));
  EXPECT_NEAR(near.depth(4, 4), 0.5, 0.05);  // its tolerance of 1/z: 0.25 / 32 at 1
}

TEST(NodeMesh, WhatIsNearIsDrawnHoweverFarTheRestIs) {
  // A card of a few vertices, hills whose outlines take many, mountains a million units away, or the sky: 10^8 then.
  std::vector<Surface> parts = {solid_box({-0.2, -0.2, -2.1}, {0.2, 0.2, -2}, by_direction(3))};
  for (int i = 0; i < 12; ++i)
    parts.push_back(sphere(5e5 * Vector3d(std::cos(0.5 * i + 0.3), 0, std::sin(0.5 * i + 0.3)), 1e5));
  std::vector<Surface> with_mountains = parts;
  with_mountains.push_back(globe({0, 0, 0}, 1e6, by_direction(3)));
  for (auto const& scene : {together(with_mountains), together(parts)}) {
    auto renderer = renderer_of({mesh_of(capture_cube(scene, Vector3d::Zero(), 64))}, 1);
    for (double const z : {0.0, -0.5, -1.0, -1.8})
      EXPECT_NEAR(renderer.render(square_camera(9, 9), look_at({0, 0, z}, {0, 0, -3})).depth(4, 4), 2 + z,
                  4 * 0.25 / 32 * 1.1)  // the parallax in 1/z, as a depth
          << z;
  }
}

TEST(NodeMesh, SidesMayHaveAnyFieldsOfViewAndShareNothing) {
  Surface const scene = room(2, by_direction(5));
  CapturedNode node{"000", Vector3d::Zero(), {}};
  node.sides.push_back(node_side(scene, square_camera(40, 60), scene_from_cube_side(0, Vector3d::Zero())));
  NodeMesh const one = mesh_of(node);
  node.sides.push_back(
      node_side(scene, Camera::perspective(64, 24, 25, 20, 30, 12), look_at({0, 0, 0}, {0.3, 0.1, -1})));
  NodeMesh const two = mesh_of(node);
  ASSERT_EQ(one.sides.size(), 1U);
  ASSERT_EQ(two.sides.size(), 2U);
  auto renderer = renderer_of({two}, 1);
  for (View const& side : node.sides) {
    Frame const frame = renderer.render(side.image.camera, *side.object_from_camera);
    EXPECT_EQ(gaps(frame), 0U);
    for (int y = 1; y + 1 < frame.color.rows; ++y)
      for (int x = 1; x + 1 < frame.color.cols; ++x)
        for (int c = 0; c < 3; ++c) ASSERT_LE(std::abs(frame.color(y, x)[c] - side.image.color(y, x)[c]), 1);
  }
  // Away from both there is nothing.
  EXPECT_EQ(drawn_pixels(renderer.render(square_camera(16, 16), look_at({0, 0, 0}, {0, 1, 0}, {0, 0, 1})).color), 0U);
}

TEST(NodeMesh, WithoutASkyNothingIsDrawnThere) {
  Surface const floor = inside_of({{{0, -1, 0}, 1}}, plain({0.3, 0.3, 0.3}));
  NodeMeshOptions options;
  options.background = NodeMeshOptions::Background::gap;
  auto renderer = renderer_of({mesh_of(capture_cube(floor, Vector3d::Zero(), 32), options)}, 1);
  EXPECT_EQ(drawn_pixels(renderer.render(square_camera(16, 16), look_at({0, 0, 0}, {0, 1, 0}, {0, 0, 1})).color), 0U);
  EXPECT_EQ(gaps(renderer.render(square_camera(16, 16), look_at({0, 0, 0}, {0, -1, 0}, {0, 0, 1}))), 0U);
}

TEST(NodeMesh, OptionsOutOfRangeAreNamed) {
  CapturedNode const node = capture_cube(room(1, plain({1, 1, 1})), Vector3d::Zero(), 8);
  auto const refused = [&](char const* name, auto set) {
    NodeMeshOptions options;
    set(options);
    EXPECT_SCANVIEW_ERROR(mesh_of(node, options), ErrorCode::usage, name);
  };
  refused("max_triangles", [](auto& o) { o.max_triangles = -1; });
  refused("parallax_px", [](auto& o) { o.parallax_px = 0; });
  refused("walking_radius", [](auto& o) { o.walking_radius = NAN; });
  refused("feather_px", [](auto& o) { o.feather_px = 0; });
}

}  // namespace
}  // namespace scanview::test
