#include "viewer/select/camera_path.h"

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <numbers>

#include "base/error.h"
#include "base/files.h"
#include "viewer/scene.h"
#include "viewer/window/orbit_control.h"
#include "viewer/window/view_window.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
constexpr double kDegree = std::numbers::pi / 180;

/// Eyes at an elevation around the axis z of a ball of radius 1 at `center`, looking a little beside it.
test::Scene turntable(int count, double elevation_deg, Vector3d const& center = {5, 6, 7},
                      Camera const& camera = Camera::perspective(64, 48, 60, 60, 32, 24)) {
  std::vector<Isometry3d> poses;
  double const e = elevation_deg * kDegree;
  for (int i = 0; i < count; ++i) {
    double const a = 2 * std::numbers::pi * i / count;
    poses.push_back(
        test::look_at(center + 4 * Vector3d(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)), center,
                      Vector3d::UnitZ()));
  }
  auto scene = test::scan(test::sphere(center, 1), camera, poses, 0.3, 0.02);
  scene.set.center = center;
  return scene;
}

TEST(Orbit, FollowsTheCircleOfATurntable) {
  auto const scene = turntable(8, 32);
  OrbitFrame const frame = orbit_frame(scene.set);
  EXPECT_LT((frame.up - Vector3d::UnitZ()).norm(), 1e-6);
  EXPECT_NEAR(frame.distance, 4, 1e-9);
  auto const path = orbit_path(scene.set, 16, 100, 80);
  ASSERT_EQ(path.size(), 16U);
  for (std::size_t i = 0; i < 8; ++i) {
    EXPECT_LT((path[2 * i].object_from_camera.translation() - scene.set.views[i].eye()).norm(), 1e-6);
  }
  for (auto const& p : path) {
    // Upright, and the centre in the middle of the picture.
    EXPECT_NEAR(p.object_from_camera.linear().col(0).z(), 0, 1e-9);
    Eigen::Vector2d const middle = p.camera.project(p.object_from_camera.inverse() * scene.set.center);
    EXPECT_LT((middle - Eigen::Vector2d(49.5, 39.5)).norm(), 1e-6);
  }
}

TEST(Orbit, HoldsTheWholeObject) {
  auto const scene = turntable(6, 10);
  for (auto const& p : orbit_path(scene.set, 5, 60, 90)) {
    // The silhouette of the ball (radius 1, distance 4) is a circle of 4/sqrt(15) focal lengths / 4.
    double const silhouette = p.camera.fx() / std::sqrt(15.0);
    EXPECT_LT(silhouette, 30);
    EXPECT_GT(silhouette, 22);
  }
}

TEST(Orbit, OrthographicScansGetAPerspectiveCamera) {
  auto const scene = turntable(4, 0, {0, 0, 0}, Camera::orthographic(50, 50, 0.05, 0.05, 25, 25));
  auto const path = orbit_path(scene.set, 4, 64, 64);
  EXPECT_TRUE(path[0].camera.is_perspective());
  EXPECT_NEAR((path[0].object_from_camera.translation()).norm(), 4 * scene.set.radius(), 1e-9);
  EXPECT_EQ(halfway_path(scene.set, 64, 64).size(), 4U);
}

TEST(Orbit, OneViewAndOppositeViewsWork) {
  for (int const count : {1, 2}) {
    auto const scene = turntable(count, 0);
    for (auto const& p : orbit_path(scene.set, 7, 20, 20)) EXPECT_TRUE(p.object_from_camera.matrix().allFinite());
    auto const halfway = halfway_path(scene.set, 20, 20);
    EXPECT_EQ(halfway.size(), static_cast<std::size_t>(count - 1));
    for (auto const& p : halfway) {
      EXPECT_TRUE(p.object_from_camera.matrix().allFinite());
      EXPECT_NEAR((p.object_from_camera.translation() - scene.set.center).norm(), 4, 1e-9);
    }
  }
}

TEST(Orbit, StraightDownWorks) {
  auto scene = turntable(1, 89.9999);
  for (auto const& p : orbit_path(scene.set, 3, 20, 20)) EXPECT_TRUE(p.object_from_camera.matrix().allFinite());
}

TEST(Halfway, LiesBetweenNeighboursAndClosesTheCircle) {
  auto const scene = turntable(8, 32);
  auto const path = halfway_path(scene.set, 64, 48);
  ASSERT_EQ(path.size(), 8U);
  EXPECT_EQ(path[0].name, "000-001");
  EXPECT_EQ(path[7].name, "007-000");
  for (std::size_t i = 0; i < 8; ++i) {
    Vector3d const a = scene.set.views[i].eye(), b = scene.set.views[(i + 1) % 8].eye();
    Vector3d const eye = path[i].object_from_camera.translation();
    EXPECT_NEAR((eye - a).norm(), (eye - b).norm(), 1e-9);
    EXPECT_NEAR((eye - scene.set.center).norm(), 4, 1e-9);
    EXPECT_EQ(path[i].camera, scene.set.views[i].image.camera);
  }
}

TEST(PathThroughViews, PassesEveryViewInEvenSteps) {
  auto const scene = turntable(5, 20);
  auto const path = path_through_views(scene.set, orbit_frame(scene.set), 9, 64, 48);
  ASSERT_EQ(path.size(), 9U);
  for (std::size_t i = 0; i < 5; ++i)
    EXPECT_TRUE(path[2 * i].object_from_camera.isApprox(*scene.set.views[i].object_from_camera, 1e-9));
  for (auto const& p : path) EXPECT_NEAR((p.object_from_camera.translation() - scene.set.center).norm(), 4, 1e-9);
  EXPECT_EQ(path[0].camera, scene.set.views[0].image.camera);
  // In a room: straight on.
  OrbitFrame room = orbit_frame(scene.set);
  room.radius = 10;
  auto const straight = path_through_views(scene.set, room, 9, 64, 48);
  Vector3d const middle = (scene.set.views[0].eye() + scene.set.views[1].eye()) / 2;
  EXPECT_LT((straight[1].object_from_camera.translation() - middle).norm(), 1e-9);
  EXPECT_EQ(path_through_views(scene.set, room, 1, 64, 48).size(), 1U);
}

TEST(CameraLike, ShowsTheWholeViewUndistorted) {
  auto const scene = turntable(3, 0);
  auto const same = camera_like(scene.set, "001", 64, 48);
  EXPECT_EQ(same.camera, scene.set.views[1].image.camera);
  auto const doubled = camera_like(scene.set, "001", 128, 96);
  auto const resized = scene.set.views[1].image.camera.resized(128, 96);
  EXPECT_EQ(doubled.camera.fx(), resized.fx());
  EXPECT_EQ(doubled.camera.fy(), resized.fy());
  EXPECT_EQ(doubled.camera.cx(), resized.cx());
  EXPECT_EQ(doubled.camera.cy(), resized.cy());
  // Wider: square pixels, the picture's middle stays in the middle.
  auto const wide = camera_like(scene.set, "001", 200, 48);
  EXPECT_EQ(wide.camera.fx(), 60);
  EXPECT_EQ(wide.camera.cx(), 32 + 68);
  EXPECT_THROW(camera_like(scene.set, "nobody", 64, 48), Error);
}

class CameraPathFile : public testing::Test {
 protected:
  CameraPathFile() { path_ = std::filesystem::path(testing::TempDir()) / "scanview_camera_path_test.json"; }
  ~CameraPathFile() override { std::filesystem::remove(path_); }
  std::vector<PathCamera> read(Json const& json) {
    write_json(path_, json);
    return read_camera_path(path_, scene_.set, 64, 48);
  }
  std::filesystem::path path_;
  test::Scene scene_ = turntable(4, 10);
};

TEST_F(CameraPathFile, KeyframesAreInterpolated) {
  Json const a = {{"object_from_camera", pose_to_json(*scene_.set.views[0].object_from_camera)},
                  {"camera", scene_.set.views[0].image.camera.to_json()}};
  Json const b = {{"object_from_camera", pose_to_json(*scene_.set.views[1].object_from_camera)}};
  auto const path = read({{"format", 1}, {"keyframes", {a, b}}, {"between", 5}});
  ASSERT_EQ(path.size(), 6U);
  EXPECT_EQ(path[0].camera, scene_.set.views[0].image.camera);
  EXPECT_TRUE(path[5].object_from_camera.isApprox(*scene_.set.views[1].object_from_camera, 1e-9));
  for (auto const& p : path) EXPECT_NEAR((p.object_from_camera.translation() - scene_.set.center).norm(), 4, 1e-6);
}

TEST_F(CameraPathFile, RefusesWhatIsNoPath) {
  Json const key = {{"object_from_camera", pose_to_json(Isometry3d::Identity())}};
  EXPECT_THROW(read(Json::array()), Error);
  EXPECT_THROW(read({{"format", 1}}), Error);
  EXPECT_THROW(read({{"format", 2}, {"keyframes", {key}}}), Error);
  EXPECT_THROW(read({{"keyframes", Json::array()}}), Error);
  EXPECT_THROW(read({{"keyframes", {Json::object()}}}), Error);
  EXPECT_THROW(read({{"keyframes", {key}}, {"between", 0}}), Error);
  EXPECT_THROW(read({{"keyframes", {key}}, {"unknown", 0}}), Error);
  EXPECT_EQ(read({{"keyframes", {key}}}).size(), 1U);
}

TEST(OrbitControl, OrbitKeepsDistanceAndHorizonAndStopsAtThePoles) {
  auto const scene = turntable(8, 32);
  OrbitControl control(scene.set, scene.set.radius());
  for (int i = 0; i < 50; ++i) {
    control.orbit(0.07, 0.11);
    auto const& pose = control.current().object_from_camera;
    EXPECT_NEAR((pose.translation() - scene.set.center).norm(), 4, 1e-9);
    EXPECT_NEAR(pose.linear().col(0).z(), 0, 1e-6);  // the horizon
    EXPECT_LT(pose.linear().col(1).z(), 0);          // never upside down
  }
  // Dragging down looks from above.
  EXPECT_GT(control.current().object_from_camera.translation().z(), scene.set.center.z() + 3.9);
}

TEST(OrbitControl, TheObjectFollowsThePointer) {
  auto const scene = turntable(8, 0);
  OrbitControl control(scene.set, scene.set.radius());
  auto const pixel = [&](Vector3d const& p) {
    return control.current().camera.project(control.current().object_from_camera.inverse() * p);
  };
  Vector3d const front = scene.set.center + (control.current().object_from_camera.translation() - scene.set.center) / 4;
  auto const before = pixel(front);
  control.orbit(0.02, 0);
  EXPECT_GT(pixel(front).x(), before.x());
  control.reset();
  control.pan(0.1, 0.2);
  int const height = control.current().camera.height();
  // The centre itself moves with the pointer exactly.
  EXPECT_NEAR(pixel(scene.set.center).x(), 0.5 * (height - 1) + 0.1 * height, 1e-6);
  EXPECT_NEAR(pixel(scene.set.center).y(), 0.5 * (height - 1) + 0.2 * height, 1e-6);
}

TEST(OrbitControl, ZoomNeverPassesThePivot) {
  auto const scene = turntable(8, 0);
  OrbitControl control(scene.set, scene.set.radius());
  control.zoom(1);
  EXPECT_NEAR((control.current().object_from_camera.translation() - scene.set.center).norm(), 3.6, 1e-9);
  control.zoom(1e6);
  EXPECT_GT((control.current().object_from_camera.translation() - scene.set.center).norm(), 0);
  control.zoom(-1e6);
  EXPECT_TRUE(control.current().object_from_camera.matrix().allFinite());
}

TEST(OrbitControl, JumpsToAView) {
  auto const scene = turntable(8, 20);
  OrbitControl control(scene.set, scene.set.radius());
  EXPECT_TRUE(control.jump(3));
  EXPECT_TRUE(control.current().object_from_camera.isApprox(*scene.set.views[3].object_from_camera));
  EXPECT_FALSE(control.jump(8));
}

TEST(ViewWindow, WithoutADisplaySaysSo) {
  if (std::getenv("DISPLAY") != nullptr || std::getenv("WAYLAND_DISPLAY") != nullptr)
    GTEST_SKIP() << "a display is there";
  auto const scene = turntable(2, 20);
  Context context;
  try {
    view_window(std::make_shared<ViewLibrary>(scene.set, scene.meshes), {}, {}, context);
    FAIL();
  } catch (Error const& error) {
    EXPECT_EQ(error.code(), ErrorCode::io);
    EXPECT_NE(error.message().find("display"), std::string::npos);
  }
}

}  // namespace
}  // namespace scanview
