#include "viewer/window/walk_window.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <numbers>
#include <random>
#include <set>
#include <thread>

#include "acquire/captured_node.h"
#include "base/error.h"
#include "base/files.h"
#include "base/srgb.h"
#include "mesh/node_mesh.h"
#include "mesh/node_mesh_file.h"
#include "temporary_folder.h"
#include "viewer/scene.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/walkthrough/walkthrough_file.h"
#include "viewer/window/held_keys.h"
#include "viewer/window/node_map.h"
#include "viewer/window/walk_panel.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::AlignedBox3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Walked = WalkControl::Walked;

WindowEvent key_event(WindowEvent::Kind kind, int key, double seconds) {
  WindowEvent event;
  event.kind = kind;
  event.key = key;
  event.seconds = seconds;
  return event;
}
constexpr auto kKey = WindowEvent::Kind::key, kKeyRelease = WindowEvent::Kind::key_release;

TEST(HeldKeys, CountTheTimeHeldWhateverFramesTake) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> frame(0.001, 0.2);
  HeldKeys keys;
  keys.feed(key_event(kKey, 'W', 10));
  double now = 10, walked = 0, sideways = 0;
  for (int i = 0; i < 50; ++i) {
    now += frame(random);
    keys.feed(key_event(kKey, 'W', now));  // the keyboard repeats
    if (i == 20) keys.feed(key_event(kKey, 'D', now));
    for (auto const& [key, seconds] : keys.take(now)) (key == 'W' ? walked : sideways) += seconds;
    EXPECT_NEAR(walked, now - 10, 1e-12);
  }
  EXPECT_GT(sideways, 0.1);
  EXPECT_LT(sideways, walked);
  keys.feed(key_event(kKeyRelease, 'W', now + 0.5));
  EXPECT_FALSE(keys.is_held('W'));
  EXPECT_TRUE(keys.is_held('D'));
  EXPECT_NEAR(keys.take(now + 2).at('W'), 0.5, 1e-12);  // and no longer
  EXPECT_FALSE(keys.take(now + 3).contains('W'));
}

TEST(HeldKeys, ATouchWithinOneSlowFrameCounts) {
  HeldKeys keys;
  keys.feed(key_event(kKey, 'W', 3));
  keys.feed(key_event(kKeyRelease, 'W', 3));
  EXPECT_EQ(keys.take(4).at('W'), HeldKeys::kTouchSeconds);
  EXPECT_FALSE(keys.any());
  // Touches between two frames add up; what was never pressed is nothing.
  for (int i = 0; i < 3; ++i) {
    keys.feed(key_event(kKey, 'W', 5 + i));
    keys.feed(key_event(kKeyRelease, 'W', 5.25 + i));
  }
  keys.feed(key_event(kKeyRelease, 'X', 9));
  auto const held = keys.take(9);
  EXPECT_EQ(held.size(), 1U);
  EXPECT_EQ(held.at('W'), 0.75);
}

TEST(Ground, IsRightHandedForAnyUp) {
  EXPECT_TRUE(Ground({0, 3, 0}).north.isApprox(-Vector3d::UnitZ()));
  EXPECT_TRUE(Ground({0, 0, 1}).north.isApprox(Vector3d::UnitY()));
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < 50; ++i) {
    Vector3d const up(normal(random), normal(random), normal(random));
    Ground const ground(up);
    EXPECT_TRUE(ground.east.cross(ground.north).isApprox(up.normalized(), 1e-12)) << up.transpose();
    EXPECT_TRUE(ground.up.isApprox(up.normalized(), 1e-12));
    EXPECT_NEAR(ground.east.norm(), 1, 1e-12);
  }
}

TEST(WalkControl, WalkingKeepsTheHeightWhereverTheEyeLooks) {
  Vector3d const up = Vector3d(0.2, 1, -0.3).normalized();
  for (double const pitch : {-80.0, 0.0, 35.0, 89.0}) {
    WalkControl control(up, std::nullopt);
    control.stand_at({1, 2, 3});
    control.face(77, pitch);
    Eigen::Isometry3d const pose = control.scene_from_camera();
    EXPECT_NEAR(pose.linear().determinant(), 1, 1e-12);
    EXPECT_NEAR(pose.linear().col(0).dot(up), 0, 1e-12);  // the horizon is level
    EXPECT_NEAR(pose.linear().col(2).dot(up), std::sin(pitch * std::numbers::pi / 180), 1e-12);
    EXPECT_EQ(control.walk({2, 0.5, 0, 0}), Walked::freely);
    Vector3d const way = control.eye() - Vector3d(1, 2, 3);
    EXPECT_NEAR(way.dot(up), 0, 1e-12);
    EXPECT_NEAR(way.dot(pose.linear().col(0)), 0.5, 1e-12);
    EXPECT_NEAR(way.norm(), std::hypot(2, 0.5), 1e-12);
    EXPECT_GT(way.dot(pose.linear().col(2)), 0);
    control.walk({0, 0, -1.5, 0});
    EXPECT_NEAR((control.eye() - Vector3d(1, 2, 3)).dot(up), -1.5, 1e-12);
  }
}

TEST(WalkControl, ARightTurnGoesFromNorthToEast) {
  WalkControl control(Vector3d::UnitY(), std::nullopt);
  EXPECT_TRUE(control.scene_from_camera().linear().col(2).isApprox(-Vector3d::UnitZ(), 1e-12));
  control.walk({0, 0, 0, 90});
  EXPECT_TRUE(control.scene_from_camera().linear().col(2).isApprox(Vector3d::UnitX(), 1e-12));
  control.walk({0, 0, 0, -180});
  EXPECT_NEAR(control.heading_deg(), 270, 1e-9);
  control.stand_at({1, 5, 1});
  control.face(Vector3d(2, -7, 0));
  EXPECT_NEAR(control.heading_deg(), 45, 1e-9);
  EXPECT_EQ(control.pitch_deg(), 0);
  control.face(Vector3d(1, 0, 1));  // right below: no direction
  EXPECT_NEAR(control.heading_deg(), 45, 1e-9);
}

TEST(WalkControl, AnArcEndsAtTheSamePlaceInAnyNumberOfParts) {
  WalkStep const whole{3, -1, 0.5, 230};
  WalkControl at_once(Vector3d::UnitZ(), std::nullopt);
  at_once.walk(whole);
  std::mt19937 random(3);
  for (int parts : {2, 7, 100}) {
    WalkControl control(Vector3d::UnitZ(), std::nullopt);
    double rest = 1;
    for (int i = 1; i < parts; ++i) {
      double const share = rest * std::uniform_real_distribution<double>(0, 0.5)(random);
      control.walk(whole * share);
      rest -= share;
    }
    control.walk(whole * rest);
    EXPECT_TRUE(control.eye().isApprox(at_once.eye(), 1e-9)) << parts;
    EXPECT_NEAR(control.heading_deg(), at_once.heading_deg(), 1e-9);
  }
  // A quarter of a circle of radius 1.
  WalkControl quarter(Vector3d::UnitY(), std::nullopt);
  quarter.walk({std::numbers::pi / 2, 0, 0, 90});
  EXPECT_TRUE(quarter.eye().isApprox(Vector3d(1, 0, -1), 1e-12));
}

TEST(WalkControl, StaysInTheBoxAndSlidesAlongIt) {
  AlignedBox3d const box(Vector3d(0, 1, 0), Vector3d(4, 1, 4));
  WalkControl control(Vector3d::UnitY(), box);
  control.stand_at({3, 1, 2});
  control.face(45, 0);
  EXPECT_EQ(control.walk({1, 0, 0, 0}), Walked::freely);
  EXPECT_EQ(control.walk({1, 0, 0, 0}), Walked::held_back);
  EXPECT_TRUE(control.eye().isApprox(Vector3d(4, 1, 2 - std::sqrt(2)), 1e-12));
  EXPECT_EQ(control.walk({0, 0, 1, 0}), Walked::held_back);
  EXPECT_EQ(control.eye().y(), 1);
  control.is_free = true;
  EXPECT_EQ(control.walk({0, 0, 1, 0}), Walked::freely);
  EXPECT_EQ(control.eye().y(), 2);
  // Caught outside, it is not moved, but comes no further away.
  control.is_free = false;
  control.stand_at({9, 2, 2});
  control.face(90, 0);
  EXPECT_EQ(control.walk({1, 0, 0, 0}), Walked::held_back);
  EXPECT_EQ(control.eye(), Vector3d(9, 2, 2));
  EXPECT_EQ(control.walk({-1, 0, 0, 0}), Walked::freely);
  EXPECT_NEAR(control.eye().x(), 8, 1e-12);
  EXPECT_EQ(control.walk({1, 0, 0, 0}), Walked::held_back);
}

TEST(WalkControl, ADragKeepsThePointUnderThePointer) {
  std::mt19937 random(11);
  auto const number = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  for (int i = 0; i < 200; ++i) {
    WalkControl control(Vector3d(0.3, -1, 0.2), std::nullopt);
    control.face(number(0, 360), number(-45, 45));
    Camera const camera = fit_camera(control.camera(), 800, 600);
    Vector2d const from(number(0, 799), number(0, 599)), to(number(0, 799), number(0, 599));
    Vector3d const before = control.scene_from_camera().linear() * camera.ray_direction(from.x(), from.y());
    control.drag(camera, from, to);
    Vector3d const after = control.scene_from_camera().linear() * camera.ray_direction(to.x(), to.y());
    if (std::abs(control.pitch_deg()) >= WalkControl::kSteepestDeg) continue;  // held
    // Where the point lies higher than a level horizon lets this pixel see, it stays as near as it can.
    double const rise = before.normalized().dot(control.ground().up);
    Vector3d const ray = camera.ray_direction(to.x(), to.y()).normalized();
    if (std::abs(rise) > std::hypot(ray.y(), ray.z())) continue;
    EXPECT_LT((before.normalized() - after.normalized()).norm(), 1e-9) << i;
  }
}

TEST(WalkControl, ThePitchIsHeldBeforeThePoles) {
  WalkControl control(Vector3d::UnitY(), std::nullopt);
  Camera const camera = control.camera();
  for (int i = 0; i < 40; ++i) control.drag(camera, {500, 300}, {500, 700});
  EXPECT_EQ(control.pitch_deg(), WalkControl::kSteepestDeg);
  for (int i = 0; i < 80; ++i) control.drag(camera, {500, 300}, {500, 0});
  EXPECT_EQ(control.pitch_deg(), -WalkControl::kSteepestDeg);
  EXPECT_TRUE(control.scene_from_camera().matrix().allFinite());
  control.face(0, 200);
  EXPECT_EQ(control.pitch_deg(), WalkControl::kSteepestDeg);
}

TEST(WalkCommands, KeysMeanWhatTheHelpSays) {
  std::set<Command> commands;
  for (char const key : std::string("MFGVTLPKHRNB ")) {
    auto const command = walk_command_of_key(key);
    ASSERT_TRUE(command) << key;
    EXPECT_TRUE(commands.insert(*command).second) << key;
    EXPECT_FALSE(walk_step_of_key(key)) << key;
    if (std::string("RNB ").find(key) != std::string::npos) continue;
    std::string line = "\n";
    line.append(1, key).append(": ");
    EXPECT_NE(walk_window_help().find(line), std::string::npos) << key;
  }
  constexpr int kHome = 268, kUp = 265, kRight = 262, kPageUp = 266;
  EXPECT_EQ(walk_command_of_key(kHome), Command::reset);
  EXPECT_EQ(walk_step_of_key('W')->forward, 1);
  EXPECT_EQ(walk_step_of_key(kUp)->forward, 1);
  EXPECT_EQ(walk_step_of_key('A')->right, -1);
  EXPECT_EQ(walk_step_of_key(kPageUp)->up, 1);
  EXPECT_EQ(walk_step_of_key('Q')->up, -1);
  EXPECT_GT(walk_step_of_key(kRight)->turn_deg, 0);
}

TEST(WalkLook, SurvivesTheOptions) {
  WalkthroughOptions options;
  options.depth_tolerance = 0.3;
  options.merged = 5;
  WalkLook look = walk_look_of(options);
  EXPECT_EQ(walk_look_of(with_walk_look(options, look)), look);
  std::set<MergePolicy> policies;
  for (std::size_t i = 0; i < kMergePolicies.size(); ++i) {
    EXPECT_TRUE(change_walk_look(look, Command::next_policy));
    policies.insert(look.policy);
  }
  EXPECT_EQ(policies.size(), kMergePolicies.size());
  change_walk_look(look, Command::toggle_filling);
  change_walk_look(look, Command::next_gaps);
  change_walk_look(look, Command::toggle_triangles);
  look.fades = false;
  WalkthroughOptions const changed = with_walk_look(options, look);
  EXPECT_EQ(changed.filling, 0);
  EXPECT_EQ(changed.gaps, VisibilityGaps::interpolated);
  EXPECT_EQ(changed.show, WalkthroughOptions::Show::triangles);
  EXPECT_EQ(changed.silhouettes, WalkthroughOptions::Silhouettes::keep);
  EXPECT_EQ(changed.depth_tolerance, 0.3);
  change_walk_look(look, Command::toggle_filling);
  EXPECT_EQ(with_walk_look(options, look).filling, options.filling);
  change_walk_look(look, Command::toggle_sources);
  EXPECT_EQ(with_walk_look(options, look).gaps, VisibilityGaps::background);  // no node's colour in a gap
  change_walk_look(look, Command::toggle_sources);
  EXPECT_EQ(look.show, WalkthroughOptions::Show::picture);
  EXPECT_FALSE(change_walk_look(look, Command::save_picture));
}

TEST(WalkLook, MagentaShowsGapsAlone) {
  cv::Mat4b picture(1, 2, cv::Vec4b(1, 2, 3, 255));
  picture(0, 1) = {0, 0, 0, 0};
  cv::Mat4b painted = picture.clone();
  paint_gaps(painted, GapLook::background);
  EXPECT_EQ(painted(0, 1), cv::Vec4b(0, 0, 0, 0));
  paint_gaps(painted, GapLook::magenta);
  EXPECT_EQ(painted(0, 0), picture(0, 0));
  EXPECT_EQ(painted(0, 1), cv::Vec4b(255, 0, 255, 255));
}

/// Three nodes in a hall with a column, in a line along x.
class Walkthrough : public testing::Test {
 protected:
  static constexpr int kNodes = 3;
  static Vector3d position(int node) { return {1.0 * node, 0.2, 0}; }

  Walkthrough() {
    auto const far_side = [](Vector3d const& o, Vector3d const& d) -> std::optional<test::Hit> {
      // A ball of radius 5 about the origin, from inside.
      double const a = d.squaredNorm(), b = o.dot(d), c = o.squaredNorm() - 25;
      double const t = (-b + std::sqrt(b * b - a * c)) / a;
      return test::Hit{t, test::paint(0.2 * (o + t * d))};
    };
    test::Surface const hall = test::together({far_side, test::sphere({1, 0, -2.5}, 0.6)});
    WalkthroughManifest manifest;
    manifest.focal_length = kSize / 2.0;
    manifest.walk = AlignedBox3d(Vector3d(-1, 0.2, -1), Vector3d(3, 0.2, 1));
    Context context;
    for (int i = 0; i < kNodes; ++i) {
      CapturedNode node;
      node.name = "00" + std::to_string(i);
      node.position = position(i);
      for (int side = 0; side < kCubeSides; ++side)
        node.sides.push_back(test::capture(hall, cube_side_camera(kSize), scene_from_cube_side(side, node.position),
                                           cube_side_name(side)));
      NodeMeshOptions options;
      options.max_triangles = 2000;
      meshes_.push_back(mesh_node(node, options, context));
      write_node_mesh(folder() / node.name, meshes_.back());
      manifest.nodes.push_back({node.name, node.position, meshes_.back().triangles.size(), 0, {node.name}});
    }
    write_walkthrough(folder(), manifest);
  }
  fs::path const& folder() const { return folder_.path(); }

  static constexpr int kSize = 48;
  TemporaryFolder folder_;
  std::vector<NodeMesh> meshes_;
};

TEST_F(Walkthrough, TheMapShowsEverythingFromAbove) {
  auto const library = make_node_library(meshes_, 1);
  WalkControl control(Vector3d::UnitY(), std::nullopt);
  control.stand_at({1, 0.2, 1});
  AlignedBox3d const box(Vector3d(-1, 0, -2), Vector3d(3, 0, 2));
  NodeMap const map = node_map(*library, {{1, 1, 0.7, 2, 30}, {2, 2, 0, 1, 5}}, box, control, 90);
  ASSERT_EQ(map.dots.size(), 3U);
  EXPECT_LT(map.dots[0].at.x(), map.dots[1].at.x());  // x is east
  EXPECT_NEAR(map.dots[0].at.y(), map.dots[1].at.y(), 1e-12);
  EXPECT_GT(map.eye.y(), map.dots[1].at.y());  // + z is south
  EXPECT_NEAR(map.eye.x(), map.dots[1].at.x(), 1e-12);
  EXPECT_EQ(map.dots[1].weight, 0.7);
  EXPECT_TRUE(map.dots[2].drawn);
  EXPECT_FALSE(map.dots[0].drawn);
  double const unit = map.dots[1].at.x() - map.dots[0].at.x();
  EXPECT_NEAR(map.bar * unit, map.bar_width, 1e-12);
  EXPECT_EQ(map.bar, 2);  // 4 units take less than all of the height
  EXPECT_EQ(map.edges.size(), 12U);
  for (auto const& edge : map.edges)
    for (Vector2d const& at : edge)
      EXPECT_TRUE((at.array() > 0).all() && at.x() < 1 && at.y() < NodeMap::kHeight) << at.transpose();
  // The view opens to the north, 45 degrees to each side.
  EXPECT_NEAR(map.view[0].x() - map.eye.x(), map.view[0].y() - map.eye.y(), 1e-12);
  EXPECT_LT(map.view[0].x(), map.view[1].x());
  EXPECT_EQ(map.nearest(map.dots[2].at + Vector2d(0.01, 0), 0.05), 2U);
  EXPECT_EQ(map.nearest({0, 0}, 0.05), 3U);
}

TEST_F(Walkthrough, FalseColourSaysWhichNodeAPixelIsFrom) {
  WalkthroughOptions options;
  options.merged = 1;
  options.show = WalkthroughOptions::Show::sources;
  WalkthroughRenderer renderer(make_node_library(meshes_, 1), options);
  WalkControl control(Vector3d::UnitY(), std::nullopt);
  control.stand_at({1.9, 0.2, 0});
  Camera const camera = fit_camera(control.camera(), 160, 120);
  auto const shown = [](std::size_t node) {
    Eigen::Vector3f const hue = view_hue(node);
    cv::Vec4b color(0, 0, 0, 255);
    for (int c = 0; c < 3; ++c) color[2 - c] = static_cast<std::uint8_t>(std::lround(255 * srgb_from_linear(hue[c])));
    return color;
  };
  Frame const frame = renderer.render(camera, control.scene_from_camera());
  std::size_t nearest = 0, others = 0;
  for (cv::Vec4b const& pixel : frame.color) {
    if (pixel[3] == 0) continue;
    if (test::greatest_difference(pixel, shown(2)) <= 1) {
      ++nearest;
    } else {
      EXPECT_TRUE(test::greatest_difference(pixel, shown(1)) <= 1 || test::greatest_difference(pixel, shown(0)) <= 1);
      ++others;
    }
  }
  EXPECT_GT(nearest, 9 * frame.color.total() / 10);
  EXPECT_LT(others, frame.color.total() / 10);
  // Triangles' edges are over the picture, in the same colours.
  options.show = WalkthroughOptions::Show::picture;
  renderer.set_options(options);
  cv::Mat4b const picture = renderer.render(camera, control.scene_from_camera()).color.clone();
  options.show = WalkthroughOptions::Show::triangles;
  renderer.set_options(options);
  cv::Mat4b const edges = renderer.render(camera, control.scene_from_camera()).color;
  std::size_t changed = 0, colored = 0;
  for (int y = 0; y < picture.rows; ++y)
    for (int x = 0; x < picture.cols; ++x) {
      changed += picture(y, x) != edges(y, x);
      colored += test::greatest_difference(edges(y, x), shown(2)) <= 1;
    }
  EXPECT_GT(colored, picture.total() / 50);
  EXPECT_LT(changed, picture.total() / 2);
}

TEST_F(Walkthrough, AFrameWithoutAFailedNodeIsComplete) {
  write_file(folder() / "001" / "mesh.ply", "junk");
  WalkthroughRenderer renderer(open_node_library(folder()), {});
  renderer.set_patience(WalkthroughRenderer::Patience::answers);
  WalkControl control(Vector3d::UnitY(), std::nullopt);
  control.stand_at(position(1));
  Camera const camera = fit_camera(control.camera(), 64, 48);
  bool complete = false;
  for (int i = 0; i < 500 && !complete; ++i) {
    renderer.render(camera, control.scene_from_camera());
    complete = renderer.complete();
    if (!complete) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  }
  EXPECT_TRUE(complete);
  NodeLibrary const& library = renderer.library();
  EXPECT_TRUE(library.has_failed(1));
  EXPECT_FALSE(library.has_failed(0));
  EXPECT_EQ(library.failures().size(), 1U);
  NodeTraffic const traffic = library.traffic();
  EXPECT_EQ(traffic.nodes, 2U);
  EXPECT_EQ(traffic.waiting, 0U);
  EXPECT_EQ(traffic.settled, 3U);
  EXPECT_EQ(traffic.bytes, library.traffic().bytes);
  EXPECT_GT(traffic.bytes, 2 * 6 * 3U * kSize * kSize);
  ASSERT_EQ(renderer.used().size(), 2U);
  EXPECT_NEAR(renderer.used()[0].weight + renderer.used()[1].weight, 1, 1e-12);
  EXPECT_TRUE(node_map(library, renderer.used(), std::nullopt, control, 80).dots[1].failed);
}

TEST(WalkPanel, SaysWhatTheFrameIsMadeOf) {
  WalkPanelContent content;
  content.names = {"hall", "003"};
  content.unit = Unit::m;
  EXPECT_EQ(used_node_text(content, {1, 0.842, 0.617, 4, 12345}), "003  62 %  0.842 m  12345 tri.");
  EXPECT_EQ(used_node_text(content, {0, 12.5, 0, 1, 7}), "hall fills   12.5 m      7 tri.");
  content.uncovered = 0.0123;
  content.stages = {{"merge", 12.34}, {"gaps", 1}};
  content.traffic.nodes = 1;
  content.traffic.bytes = 5 << 20;
  std::vector<std::string> const expected = {"uncovered 1.23 %", "gaps 1.0 ms", "merge 12.3 ms",
                                             "in memory 1 of 2 nodes, 5 MB"};
  EXPECT_EQ(walk_frame_text(content), expected);
  content.unit = Unit::arbitrary;
  EXPECT_EQ(used_node_text(content, {0, 12.5, 0, 1, 7}).find(" m "), std::string::npos);
}

bool has_display() { return std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr; }

TEST_F(Walkthrough, AWindowWithoutADisplaySaysSo) {
  if (has_display()) GTEST_SKIP() << "a display is there";
  Context context;
  try {
    view_walkthrough(folder(), {}, context);
    FAIL();
  } catch (Error const& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
    EXPECT_NE(error.message().find("display"), std::string::npos);
  }
}

TEST_F(Walkthrough, AWindowMeasuresACircleAndNamesWhatFails) {
  if (!has_display()) GTEST_SKIP() << "no display is there";
  write_file(folder() / "002" / "mesh.ply", "junk");
  WalkWindowOptions options;
  options.width = 500;
  options.height = 300;
  options.frames = 6;
  Context context;
  WalkWindowResult const result = view_walkthrough(folder(), options, context);
  ASSERT_TRUE(result.times);
  EXPECT_GT(result.times->width, 100);
  EXPECT_GT(result.times->frame_milliseconds, 0);
  EXPECT_GT(result.triangles, 100);
  EXPECT_LT(result.uncovered, 0.05);
  ASSERT_EQ(result.failures.size(), 1U);
  EXPECT_NE(result.failures[0].find("002"), std::string::npos);
}

}  // namespace
}  // namespace scanview
