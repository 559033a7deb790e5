#include "synth/node_placement.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "tests/expect_error.h"
#include "tests/synth/rooms.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

WalkRegion region_of_rooms(int rooms) {
  return {Eigen::AlignedBox3d(Vector3d(-3, 1.5, -3), Vector3d(6.2 * rooms - 3.2, 1.5, 3))};
}

PlacementOptions options() {
  PlacementOptions options;
  options.clearance = 0.3;
  options.steps = 100;
  return options;
}

Placement place(TriangleMesh const& scene, WalkRegion const& region, PlacementOptions const& how = options()) {
  Context context;
  return place_nodes(scene, region, how, context);
}

/// The greatest share of 2000 random directions, from other eyes, that is seen from no node: by first hits alone, of
/// rays from the eye and from the nodes.
double worst_gap(TriangleMesh const& mesh, Placement const& placement, WalkRegion const& region) {
  RayScene const rays(mesh.vertices, mesh.triangles);
  SceneSight const scene(mesh, SceneWinding::trusted);
  Context other;
  other.seed = 99;
  double worst = 0;
  for (Vector3d const& eye : walkable_eyes(scene, region, options(), other)) {
    CounterRandom random(5, 0);
    int unseen = 0;
    constexpr int kDirections = 2000;
    for (int i = 0; i < kDirections; ++i) {
      Eigen::Vector3f const direction =
          Vector3d(random.normal(), random.normal(), random.normal()).normalized().cast<float>();
      RayHit const hit = rays.first_hit(eye.cast<float>(), direction);
      Eigen::Vector3f const point = eye.cast<float>() + hit.distance * direction;
      bool seen = false;
      for (Vector3d const& node : placement.nodes) {
        Eigen::Vector3f const to_point = point - node.cast<float>();
        seen = seen || rays.first_hit(node.cast<float>(), to_point).distance > 1 - 1e-4F;
      }
      unseen += !seen;
    }
    worst = std::max(worst, static_cast<double>(unseen) / kDirections);
  }
  return worst;
}

/// Options for scenes that are placed often.
PlacementOptions coarse_options() {
  PlacementOptions coarse = options();
  coarse.spacing = 0.8;
  coarse.directions = 256;
  coarse.greatest_gap = 0.004;
  return coarse;
}

TEST(NodePlacement, AnEmptyRoomNeedsOneNode) {
  Placement const placement = place(make_rooms(1), region_of_rooms(1));
  EXPECT_EQ(placement.nodes.size(), 1u);
  EXPECT_EQ(placement.ended, CoverEnd::covered);
  EXPECT_GE(placement.eyes, 300u);
  EXPECT_LE(placement.eyes, 600u);
}

TEST(NodePlacement, TwoRoomsWithADoorwayNeedTwoOrThree) {
  Placement const placement = place(make_rooms(2), region_of_rooms(2));
  EXPECT_GE(placement.nodes.size(), 2u);
  EXPECT_LE(placement.nodes.size(), 3u);
}

TEST(NodePlacement, AColumnNeedsASecondNode) {
  TriangleMesh scene = make_rooms(1);
  add_column(scene, 0.4, -0.2);
  Placement const placement = place(scene, region_of_rooms(1));
  EXPECT_GE(placement.nodes.size(), 2u);
  EXPECT_LE(placement.nodes.size(), 3u);
}

TEST(NodePlacement, NoEyeHasAGapAboveTheGreatestAndNodesAreWalkable) {
  TriangleMesh scene = make_rooms(3);
  for (int i = 0; i < 3; ++i) add_column(scene, 6.2 * i + 0.5 * i - 0.8, 0.9 - 0.7 * i);
  WalkRegion const region = region_of_rooms(3);
  Placement const placement = place(scene, region);
  EXPECT_EQ(placement.ended, CoverEnd::covered);
  EXPECT_LE(placement.nodes.size(), 6u);  // two a room, by hand, on opposite sides of the column
  // What 2000 directions say of a share of 0.002 scatters by 0.001; the eyes are others, too.
  EXPECT_LE(worst_gap(scene, placement, region), 0.002 + 3 * 0.001);
  EXPECT_LE(placement.uncovered_mean, 0.0005);
  SceneSight const sight(scene, SceneWinding::trusted);
  for (Vector3d const& node : placement.nodes) {
    EXPECT_TRUE(region.box.contains(node));
    EXPECT_GE(sight.distance(node, 1), 0.3);
    EXPECT_FALSE(sight.is_inside_object(node));
  }
}

TEST(NodePlacement, ThreadsDoNotMatter) {
  TriangleMesh scene = make_rooms(2);
  add_column(scene, 1, 1);
  Context one, many;
  one.threads = 1;
  many.threads = 8;
  Placement const a = place_nodes(scene, region_of_rooms(2), coarse_options(), one);
  Placement const b = place_nodes(scene, region_of_rooms(2), coarse_options(), many);
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.uncovered_mean, b.uncovered_mean);
}

TEST(NodePlacement, AScaledSceneHasTheScaledNodes) {
  TriangleMesh scene = make_rooms(2);
  add_column(scene, 1, 1);
  Placement const expected = place(scene, region_of_rooms(2), coarse_options());
  for (double const scale : {1024.0, 1.0 / 1024, 1000.0, 0.001}) {
    TriangleMesh scaled = scene;
    for (auto& v : scaled.vertices) v = (scale * v.cast<double>()).cast<float>();
    WalkRegion region = region_of_rooms(2);
    region.box = Eigen::AlignedBox3d(scale * region.box.min(), scale * region.box.max());
    PlacementOptions how = coarse_options();
    how.clearance *= scale;
    how.spacing *= scale;
    Placement const found = place(scaled, region, how);
    ASSERT_EQ(found.nodes.size(), expected.nodes.size()) << scale;
    for (std::size_t i = 0; i < found.nodes.size(); ++i)
      EXPECT_LT((found.nodes[i] / scale - expected.nodes[i]).norm(), 1e-9) << scale;
  }
}

TEST(NodePlacement, AClosetThatNobodyCanReachHasANodeOfItsOwn) {
  TriangleMesh scene = make_rooms(1);
  add_block(scene, {1, 0, 1}, {1.1, 3, 3});
  add_block(scene, {1, 0, 1}, {3, 3, 1.1});
  Placement const placement = place(scene, region_of_rooms(1));
  int inside = 0;
  for (Vector3d const& node : placement.nodes) inside += node.x() > 1.1 && node.z() > 1.1;
  EXPECT_EQ(inside, 1);
  EXPECT_EQ(placement.nodes.size(), 2u);  // the closet's corner is convex towards itself alone; the rest sees round it
}

TEST(NodePlacement, FewerNodesThanNeededLeaveGapsAndSaySo) {
  PlacementOptions how = options();
  how.most_nodes = 1;
  Placement const placement = place(make_rooms(2), region_of_rooms(2), how);
  EXPECT_EQ(placement.nodes.size(), 1u);
  EXPECT_EQ(placement.ended, CoverEnd::most_sets);
  EXPECT_GT(placement.uncovered_worst, 0.3);
}

TEST(NodePlacement, ARegionWithoutAnyWalkableEyeIsRefused) {
  WalkRegion const in_the_wall{Eigen::AlignedBox3d(Vector3d(3, 1, -3), Vector3d(3.2, 2, 3))};
  EXPECT_SCANVIEW_ERROR(place(make_rooms(1), in_the_wall), ErrorCode::bad_input, "clearance");
  WalkRegion const below_the_ceiling{Eigen::AlignedBox3d(Vector3d(-3, 2.8, -3), Vector3d(3, 2.9, 3))};
  EXPECT_SCANVIEW_ERROR(place(make_rooms(1), below_the_ceiling), ErrorCode::bad_input, "Move the region");
  EXPECT_SCANVIEW_ERROR(place(make_rooms(1), WalkRegion{}), ErrorCode::bad_input, "no box");
  TriangleMesh block;
  add_block(block, {0, 0, 0}, {1, 1, 1});
  add_block(block, {0, 9, 0}, {1, 10, 1});
  WalkRegion const inside{Eigen::AlignedBox3d(Vector3d(0.4, 0.4, 0.4), Vector3d(0.6, 0.6, 0.6))};
  EXPECT_SCANVIEW_ERROR(place(block, inside), ErrorCode::bad_input, "inside objects");
}

TEST(NodePlacement, IgnoredWindingWalksInARoomThatIsWoundOutward) {
  TriangleMesh room;
  add_block(room, {-3, 0, -3}, {3, 3, 3});
  EXPECT_SCANVIEW_ERROR(place(room, region_of_rooms(1)), ErrorCode::bad_input, "winding");
  PlacementOptions how = options();
  how.winding = SceneWinding::ignored;
  EXPECT_EQ(place(room, region_of_rooms(1), how).nodes.size(), 1u);
}

TEST(NodePlacement, ImpossibleOptionsAreNamed) {
  auto const refused = [](auto change) {
    PlacementOptions how;
    change(how);
    how.validate();
  };
  EXPECT_SCANVIEW_ERROR(refused([](auto& o) { o.clearance = -1; }), ErrorCode::usage, "clearance");
  EXPECT_SCANVIEW_ERROR(refused([](auto& o) { o.spacing = NAN; }), ErrorCode::usage, "spacing");
  EXPECT_SCANVIEW_ERROR(refused([](auto& o) { o.directions = 0; }), ErrorCode::usage, "directions");
  EXPECT_SCANVIEW_ERROR(refused([](auto& o) { o.greatest_gap = 1; }), ErrorCode::usage, "greatest_gap");
  EXPECT_SCANVIEW_ERROR(refused([](auto& o) { o.most_nodes = 0; }), ErrorCode::usage, "most_nodes");
  EXPECT_SCANVIEW_ERROR(refused([](auto& o) { o.steps = -1; }), ErrorCode::usage, "steps");
  PlacementOptions fine = options();
  fine.spacing = 0.002;
  EXPECT_SCANVIEW_ERROR(place(make_rooms(1), region_of_rooms(1), fine), ErrorCode::bad_input, "greater spacing");
  fine.spacing = 0.05;
  EXPECT_SCANVIEW_ERROR(place(make_rooms(1), region_of_rooms(1), fine), ErrorCode::bad_input, "1: choose");
}

TEST(DefaultWalkRegion, IsTheFloorAtEyeHeight) {
  TriangleMesh scene = make_rooms(2);
  add_column(scene, 1, 1);
  PlacementOptions const how = options();
  WalkRegion const region = default_walk_region(scene, how);
  EXPECT_NEAR(region.box.min().y(), 0.45 * 3, 1e-4);
  EXPECT_EQ(region.box.min().y(), region.box.max().y());
  EXPECT_NEAR(region.box.min().x(), -3.2 + 0.3, 1e-6);
  EXPECT_NEAR(region.box.max().z(), 3.2 - 0.3, 1e-6);
  EXPECT_NEAR(default_walk_region(scene, how, 1.6).box.max().y(), 1.6, 1e-4);
  TriangleMesh block;
  add_block(block, {0, 0, 0}, {1, 1, 1});
  EXPECT_SCANVIEW_ERROR(default_walk_region(block), ErrorCode::bad_input, "no floor");
}

}  // namespace
}  // namespace scanview
