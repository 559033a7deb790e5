#include "viewer/window/model_window.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <numbers>
#include <set>

#include "base/error.h"
#include "viewer/raster_reference.h"
#include "viewer/scene.h"
#include "viewer/window/commands.h"
#include "viewer/window/keyframes.h"
#include "viewer/window/line_drawing.h"
#include "viewer/window/orbit_control.h"
#include "viewer/window/viewed_model.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector3d;

Camera const kCamera = Camera::perspective(160, 120, 150, 150, 79.5, 59.5);

/// A ball of radius 1 and a smaller one that it hides from +z.
PolygonModel balls() {
  PolygonModel model;
  model.mesh = test::sphere_mesh(40, 20);
  TriangleMesh const small = test::sphere_mesh(20, 10);
  int const base = static_cast<int>(model.mesh.vertices.size());
  for (auto const& v : small.vertices) model.mesh.vertices.push_back(0.3F * v + Eigen::Vector3f(0, 0, -2));
  for (auto const& t : small.triangles) model.mesh.triangles.push_back(t + Eigen::Vector3i::Constant(base));
  return model;
}

/// Two triangles |x|, |y| <= half at a height, facing +z.
void add_square(TriangleMesh& mesh, float half, float z) {
  int const base = static_cast<int>(mesh.vertices.size());
  for (auto const& corner :
       {Eigen::Vector2f(-1, -1), Eigen::Vector2f(1, -1), Eigen::Vector2f(1, 1), Eigen::Vector2f(-1, 1)})
    mesh.vertices.emplace_back(half * corner.x(), half * corner.y(), z);
  mesh.triangles.emplace_back(base, base + 1, base + 2);
  mesh.triangles.emplace_back(base, base + 2, base + 3);
}

bool same_picture(cv::Mat4b const& a, cv::Mat4b const& b) {
  return a.size() == b.size() && std::equal(a.begin(), a.end(), b.begin());
}

TEST(ModelCommands, KeysMeanWhatTheHelpSays) {
  std::set<Command> commands;
  for (char const key : std::string("FVTGNCUHRP ")) {
    auto const command = model_command_of_key(key);
    ASSERT_TRUE(command) << key;
    EXPECT_TRUE(commands.insert(*command).second) << key;
    if (key == ' ') continue;
    EXPECT_NE(model_window_help().find(std::string(1, key) + ": "), std::string::npos) << key;
  }
  constexpr int kEscape = 256, kTab = 258;
  EXPECT_EQ(model_command_of_key(kEscape), Command::quit);
  EXPECT_EQ(model_command_of_key(kTab), Command::toggle_panel);
  EXPECT_FALSE(model_command_of_key('M'));  // a set's
  EXPECT_FALSE(command_of_key('F', WindowMode::look));
}

TEST(OrbitControl, TurnsAboutSomethingWithoutViews) {
  OrbitFrame frame;
  frame.up = up_direction(UpAxis::minus_z);
  frame.start = Vector3d(1, 0, -0.2).normalized();
  frame.radius = 2;
  frame.distance = 8;
  Vector3d const center(10, 20, 30);
  OrbitControl control(center, frame);
  auto const pose = [&] { return control.current().object_from_camera; };
  EXPECT_TRUE(pose().translation().isApprox(center + 8 * frame.start, 1e-12));
  EXPECT_LT(pose().linear().col(1).z(), 1);
  EXPECT_GT(pose().linear().col(1).z(), 0.9);  // the camera's y runs down, which is +z
  EXPECT_FALSE(control.jump(0));
  control.turn(180);
  EXPECT_NEAR((pose().translation() - center).dot(frame.start), 8 * (0.04 - 1) / 1.04, 1e-9);
  control.reset();
  EXPECT_TRUE(pose().translation().isApprox(center + 8 * frame.start, 1e-12));
}

TEST(ViewedModel, WhatIsLeftOutChangesNoPixel) {
  PolygonModel const model = balls();
  Context context;
  VisibilityOptions options;
  options.samples = 66;
  options.resolution = 128;
  options.patches = 100;
  ViewedModel whole(model, std::nullopt, 0);
  ViewedModel culled(model, build_visibility(model, options, context), 0);
  ModelLook everything;
  everything.visibility = false;
  for (auto const& eye : {Vector3d(0.1, 0.2, 7), Vector3d(5, -3, 2), Vector3d(-1, 6, -4)}) {
    SCOPED_TRACE(eye.transpose());
    Isometry3d const pose = test::look_at(eye, {0, 0, -0.5});
    cv::Mat4b const expected = whole.render(kCamera, pose, {}, eye).frame.color;
    EXPECT_GT(test::drawn_pixels(expected), 1000U);
    EXPECT_EQ(whole.figures().triangles, model.mesh.triangles.size());
    for (bool const facing : {true, false}) {
      ModelLook look;
      look.facing = facing;
      EXPECT_TRUE(same_picture(culled.render(kCamera, pose, look, eye).frame.color, expected));
      EXPECT_FALSE(culled.figures().is_whole);
      // Of two balls, without that, nearly every patch has a triangle on this side of some sample's rim.
      EXPECT_LT(culled.figures().triangles, (facing ? 7U : 10U) * model.mesh.triangles.size() / 10);
      EXPECT_GT(culled.figures().ranges, 0U);
      EXPECT_GT(culled.figures().patches, 0U);
    }
    EXPECT_TRUE(same_picture(culled.render(kCamera, pose, everything, eye).frame.color, expected));
    EXPECT_EQ(culled.figures().triangles, model.mesh.triangles.size());
  }
}

TEST(ViewedModel, AFrozenEyeLeavesOutWhatItDoesNotSee) {
  PolygonModel const model = balls();
  Context context;
  VisibilityOptions options;
  options.samples = 66;
  options.resolution = 128;
  options.patches = 100;
  ViewedModel viewed(model, build_visibility(model, options, context), 0);
  Vector3d const frozen(0.1, 0.2, 9), eye(8, 1, -4);
  Isometry3d const pose = test::look_at(eye, {0, 0, -0.5});
  ModelLook look;
  auto const drawn = [&](Vector3d const& choosing) {
    return test::drawn_pixels(viewed.render(kCamera, pose, look, choosing).frame.color);
  };
  std::size_t const all = drawn(eye);
  std::size_t const kept = drawn(frozen);
  EXPECT_LT(kept, all);
  EXPECT_GT(kept, all / 10);
  std::size_t const triangles = viewed.figures().triangles;
  EXPECT_EQ(drawn(frozen), kept);
  look.culled = true;
  EXPECT_EQ(drawn(frozen), all);
  EXPECT_EQ(viewed.figures().triangles, triangles);  // those that are faint do not count
  look.culled = false;
  EXPECT_EQ(drawn(frozen), kept);
  // Nearer than the samples, nothing is known.
  drawn({0, 0, 1.1});
  EXPECT_TRUE(viewed.figures().is_whole);
  EXPECT_EQ(viewed.figures().triangles, model.mesh.triangles.size());
}

TEST(ViewedModel, LightPassesThroughWhatIsTransparent) {
  PolygonModel model;
  add_square(model.mesh, 1, 0);
  add_square(model.mesh, 0.5F, 1);
  model.mesh.colors.assign(4, {0, 0, 255});
  model.mesh.colors.resize(8, {255, 0, 0});
  model.transparent = {0, 0, 1, 1};
  ViewedModel viewed(model, std::nullopt, 0);
  auto const middle = [&](Vector3d const& eye) {
    return viewed.render(kCamera, test::look_at(eye, {0, 0, 0}), {}, eye).frame.color(60, 80);
  };
  cv::Vec4b const before = middle({0, 0, 5});
  EXPECT_GT(before[2], 100);  // red, through blue
  EXPECT_GT(before[0], 50);
  EXPECT_EQ(before[3], 255);
  EXPECT_NEAR(viewed.shown().frame.depth(60, 80), 5, 1e-3);  // a click goes through
  cv::Vec4b const behind = middle({0, 0, -5});
  EXPECT_EQ(behind[0], 0);
  model.transparent = {1, 1, 1, 1};
  ViewedModel clear(model, std::nullopt, 0);
  cv::Vec4b const alone = clear.render(kCamera, test::look_at({0, 0, 5}, {0, 0, 0}), {}, {0, 0, 5}).frame.color(60, 80);
  EXPECT_GT(alone[3], 0);
  EXPECT_LT(alone[3], 255);
}

TEST(ViewedModel, DrawsLinesOnPaper) {
  PolygonModel model;
  add_square(model.mesh, 1, 0);
  add_square(model.mesh, 0.5F, -1);  // hidden
  ViewedModel viewed(model, std::nullopt, 0);
  ModelLook look;
  look.lines = true;
  Isometry3d const pose = test::look_at({0, 0, 5}, {0, 0, 0});
  cv::Mat4b const picture = viewed.render(kCamera, pose, look, {0, 0, 5}).frame.color;
  EXPECT_EQ(viewed.figures().lines, 8U);
  // The rim at x = ±1, y = ±1 is 30 pixels from the middle.
  for (int y = 0; y < picture.rows; ++y) {
    for (int x = 0; x < picture.cols; ++x) {
      double const off = std::abs(std::max(std::abs(x - 79.5), std::abs(y - 59.5)) - 30);
      if (off > 1.5) {
        EXPECT_EQ(picture(y, x), cv::Vec4b(255, 255, 255, 255)) << x << " " << y;
      } else if (off < 0.6) {
        EXPECT_LT(picture(y, x)[0], 190) << x << " " << y;
      }
    }
  }
}

TEST(ViewedModel, NothingToBeSeenIsAnError) {
  EXPECT_THROW(ViewedModel(PolygonModel{}, std::nullopt, 0), Error);
  PolygonModel point;
  point.mesh.vertices = {{1, 2, 3}};
  point.mesh.triangles = {{0, 0, 0}};
  EXPECT_THROW(ViewedModel(point, std::nullopt, 0), Error);
  // Turned away, there is nothing, and no error.
  ViewedModel viewed(balls(), std::nullopt, 0);
  ModelLook lines;
  lines.lines = true;
  for (ModelLook const& look : {ModelLook{}, lines}) {
    auto const& shown = viewed.render(kCamera, test::look_at({0, 0, 5}, {0, 0, 9}), look, {0, 0, 5});
    EXPECT_EQ(cv::countNonZero(shown.frame.depth == shown.frame.depth), 0);
  }
}

TEST(LineDrawing, LinesAreClippedAndHidden) {
  cv::Mat1f depth(kCamera.height(), kCamera.width(), std::numeric_limits<float>::quiet_NaN());
  depth.colRange(80, 160) = 3.0F;
  auto const ink = [&](Eigen::Vector3f const& a, Eigen::Vector3f const& b) {
    cv::Mat4b paper(depth.size(), cv::Vec4b(255, 255, 255, 255));
    draw_seen_lines(paper, depth, kCamera, Isometry3d::Identity(), {a, b}, {{0, 1}});
    int left = 0, right = 0;
    for (int y = 0; y < paper.rows; ++y) {
      for (int x = 0; x < paper.cols; ++x) {
        if (paper(y, x)[0] < 128) ++(x < 79 ? left : right);
      }
    }
    return std::pair(left, right);
  };
  // Through the whole picture: before what is there, upon it, behind it.
  for (float const z : {2.0F, 3.0F}) {
    auto const [left, right] = ink({-9, 0.01F, z}, {9, 0.01F, z});
    EXPECT_NEAR(left, 79, 2);
    EXPECT_NEAR(right, 81, 2);
  }
  auto const [left, right] = ink({-9, 0.01F, 4}, {9, 0.01F, 4});
  EXPECT_NEAR(left, 79, 2);
  EXPECT_LE(right, 3);  // a pixel beyond the rim
  // From behind the eye; beside the picture; a point.
  EXPECT_GT(ink({-0.5F, 0, 2}, {-0.5F, 0, -2}).first, 20);
  EXPECT_EQ(ink({-0.5F, 9, 2}, {0.5F, 9, 2}), std::pair(0, 0));
  EXPECT_EQ(ink({0, 0, -1}, {0, 0, -2}), std::pair(0, 0));
  EXPECT_LE(ink({-0.5F, 0, 2}, {-0.5F, 0, 2}).first, 2);
}

TEST(Keyframes, CamerasForSamplingAreReadBack) {
  fs::path const file = fs::path(testing::TempDir()) / "scanview_model_cameras.json";
  Keyframes cameras;
  cameras.between = 1;
  for (int i = 0; i < 3; ++i) cameras.add({kCamera, test::around(40 * i, 10), ""});
  cameras.save_as(file);
  cameras.add({kCamera, test::around(150, -10), ""});
  cameras.save("/no/such/folder");  // goes on in its file
  ScanSet set;
  auto const path = read_camera_path(file, set, OrbitFrame{Vector3d::UnitY(), Vector3d::UnitZ(), 4, 1}, 160, 120);
  fs::remove(file);
  ASSERT_EQ(path.size(), 4U);
  EXPECT_EQ(path[3].camera, kCamera);
  EXPECT_TRUE(path[1].object_from_camera.isApprox(test::around(40, 10), 1e-12));
}

TEST(ModelWindow, WithoutADisplaySaysSo) {
  if (std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr)
    GTEST_SKIP() << "a display is there";
  Context context;
  try {
    view_model(balls(), std::nullopt, {}, context);
    FAIL();
  } catch (Error const& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
    EXPECT_NE(error.message().find("display"), std::string::npos);
  }
}

}  // namespace
}  // namespace scanview
