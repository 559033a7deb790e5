#include "mesh/outline.h"

#include <gtest/gtest.h>

#include <set>

#include "mesh/view_mesh.h"
#include "tests/mesh/depth_maps.h"

namespace scanview {
namespace {

using namespace testing;

double cross(Eigen::Vector2d const& a, Eigen::Vector2d const& b) { return a.x() * b.y() - a.y() * b.x(); }

Outline outline_of(std::function<double(int, int)> const& depth, Camera const& camera = small_camera()) {
  return trace_outline(find_surface_links(depth_map(camera, 1e-3, depth), 6, 1));
}

/// Each segment passes between the pixels of its gates, left ones on its left, and no nearer than promised.
void expect_parts_its_gates(Outline const& outline) {
  for (OutlineSegment const& segment : outline.segments) {
    Eigen::Vector2d const from = outline.vertices[segment.from].position;
    Eigen::Vector2d const along = (outline.vertices[segment.to].position - from).normalized();
    ASSERT_FALSE(segment.gates.empty());
    for (Gate const& gate : segment.gates) {
      ASSERT_EQ((gate.left - gate.right).cwiseAbs().sum(), 1);
      EXPECT_GE(cross(along, gate.left.cast<double>() - from), 0.005);
      EXPECT_LE(cross(along, gate.right.cast<double>() - from), -0.005);
    }
  }
}

TEST(Outline, ARectangleHasFourSegments) {
  Outline const outline = outline_of([](int x, int y) {
    return x >= 10 && x < 30 && y >= 20 && y < 50 ? 2.0 : std::numeric_limits<double>::quiet_NaN();
  });
  EXPECT_EQ(outline.segments.size(), 4u);
  std::set<std::pair<double, double>> corners;
  for (OutlineVertex const& v : outline.vertices) corners.insert({v.position.x(), v.position.y()});
  EXPECT_EQ(corners, (std::set<std::pair<double, double>>{{9.5, 19.5}, {29.5, 19.5}, {29.5, 49.5}, {9.5, 49.5}}));
}

TEST(Outline, TheWholePictureHasFourSegments) {
  EXPECT_EQ(outline_of([](int, int) { return 2.0; }).segments.size(), 4u);
}

/// 3 away, but for a flap that bends forward out of the plane: a straight cut at x = 40.5 along one side of it, to
/// which its depth falls off, between rows where it is flat again.
double flap(int x, int y) {
  if (x > 40 || x <= 20 || y <= 20 || y >= 60) return 3;
  double const along = std::min(y - 20, 60 - y) / 20.0;
  return 3 - 0.05 * (x - 20) * along;
}

TEST(Outline, ASlitHasAVertexBetweenItsEnds) {
  Outline const outline = outline_of(flap);
  std::size_t on_slit = 0;
  for (OutlineSegment const& segment : outline.segments) {
    double const a = outline.vertices[segment.from].position.x(), b = outline.vertices[segment.to].position.x();
    on_slit += std::abs(a - 40.5) < 1 && std::abs(b - 40.5) < 1;
  }
  EXPECT_GE(on_slit, 2u);
  expect_parts_its_gates(outline);
}

TEST(Outline, NoTriangleSpansASlit) {
  RangeImage const image = depth_map(small_camera(), 1e-3, flap);
  Context context;
  MeshOptions options;
  options.placement = MeshOptions::Placement::insertion;
  options.tolerance_kind = MeshOptions::Tolerance::units;
  options.tolerance = 0.01;
  ViewMesh const result = mesh_range_image(image, options, context).view_mesh;
  for (Eigen::Vector3i const& t : result.mesh.triangles) {
    bool left = false, right = false;
    double least_y = 1e9, greatest_y = 0;
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector2d const p = image.camera.project(result.mesh.vertices[t[i]].cast<double>());
      left = left || p.x() < 40;
      right = right || p.x() > 41;
      least_y = std::min(least_y, p.y());
      greatest_y = std::max(greatest_y, p.y());
    }
    // Where the flap stands off the plane by more than a step's tolerance.
    EXPECT_FALSE(left && right && least_y > 26 && greatest_y < 54) << least_y << " " << greatest_y;
  }
}

TEST(Outline, AFreeLoopBeginsWhereItNeedsFewestSegments) {
  // A rectangle that no node lies on, and whose first corner in reading order is no corner of it: turned.
  Outline const outline = outline_of([](int x, int y) {
    return std::abs(x - 48) + std::abs(y - 40) < 20 ? 2.0 : std::numeric_limits<double>::quiet_NaN();
  });
  EXPECT_LE(outline.segments.size(), 8u);
  expect_parts_its_gates(outline);
}

TEST(Outline, FollowsTheFrameExactlyToWhereTheObjectLeavesIt) {
  Outline const outline =
      outline_of([](int x, int y) { return y < 5 && x < 30 ? std::numeric_limits<double>::quiet_NaN() : 2.0; });
  std::set<std::pair<double, double>> places;
  for (OutlineVertex const& v : outline.vertices) places.insert({v.position.x(), v.position.y()});
  for (auto const& corner : {std::pair(29.5, -0.5), {95.5, -0.5}, {95.5, 79.5}, {-0.5, 79.5}, {-0.5, 4.5}})
    EXPECT_TRUE(places.contains(corner)) << corner.first << " " << corner.second;
}

TEST(Outline, AStraightSlantedStepIsAFewSegments) {
  for (double slope : {0.1, 0.37, 1.0, 2.3}) {
    Outline const outline = outline_of([&](int x, int y) { return y > slope * x + 3.3 ? 2.0 : 3.0; });
    // The border's pieces, and the step's: more than one, since from its end at a corner no line follows all of it.
    EXPECT_LE(outline.segments.size(), 20u) << slope;
    expect_parts_its_gates(outline);
  }
}

TEST(Outline, ADiscNeedsFewSegmentsAndStaysWithinHalfAPixel) {
  double const radius = 30.2;
  Outline const outline = outline_of([&](int x, int y) {
    return std::hypot(x - 48, y - 40) < radius ? 2.0 : std::numeric_limits<double>::quiet_NaN();
  });
  // A chord of length L deviates by L²/8R, by half a pixel at 11 pixels: 17 chords at best, 8 pixels of boundary at
  // worst.
  EXPECT_LE(outline.segments.size(), 40u);
  for (OutlineSegment const& segment : outline.segments)
    for (double t : {0.0, 0.25, 0.5, 0.75}) {
      Eigen::Vector2d const p = (1 - t) * outline.vertices[segment.from].position +
                                t * outline.vertices[segment.to].position - Eigen::Vector2d(48, 40);
      EXPECT_NEAR(p.norm(), radius, 1.0);
    }
  expect_parts_its_gates(outline);
}

TEST(Outline, EveryCrackIsPassedByExactlyOnePieceOfRandomOutlines) {
  for (int percent : {10, 45, 60, 80}) {
    Camera const camera = small_camera(60, 50);
    RangeImage const image = depth_map(camera, 1e-3, [&](int x, int y) {
      CounterRandom random(3, std::uint64_t(y) << 32 | std::uint32_t(x), percent);
      if (random.uniform() * 100 >= percent) return std::numeric_limits<double>::quiet_NaN();
      return random.uniform() < 0.9 ? 2.0 : 3.0;
    });
    SurfaceLinks const links = find_surface_links(image, 6, 1);
    Outline const outline = trace_outline(links);
    expect_parts_its_gates(outline);
    std::set<std::array<int, 4>> passed;
    for (OutlineSegment const& segment : outline.segments)
      for (Gate const& gate : segment.gates)
        passed.insert({std::min(gate.left.y(), gate.right.y()), std::min(gate.left.x(), gate.right.x()),
                       std::max(gate.left.y(), gate.right.y()), std::max(gate.left.x(), gate.right.x())});
    std::size_t cracks = 0;
    for (int y = -1; y < 50; ++y)
      for (int x = -1; x < 60; ++x)
        for (auto const& [u, v] : {std::pair(x + 1, y), std::pair(x, y + 1)}) {
          bool const a = links.is_object(x, y), b = links.is_object(u, v);
          bool const parted = a != b || (a && !links.linked(x, y, u, v));
          cracks += parted;
          EXPECT_EQ(parted, passed.count({y, x, v, u}) == 1) << x << " " << y;
        }
    EXPECT_EQ(cracks, passed.size());
  }
}

TEST(Outline, VerticesLieOnEighthsOfPixels) {
  Outline const outline = outline_of([](int x, int y) { return std::hypot(x - 30, y - 30) < 20 ? 2.0 : 3.0; });
  for (OutlineVertex const& v : outline.vertices) {
    EXPECT_EQ(8 * v.position.x(), std::round(8 * v.position.x()));
    EXPECT_EQ(8 * v.position.y(), std::round(8 * v.position.y()));
    EXPECT_GE(v.pixels.size(), 1u);
  }
}

}  // namespace
}  // namespace scanview
