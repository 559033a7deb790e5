#include "viewer/walkthrough/walk_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numbers>

#include "base/error.h"
#include "base/random.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

Vector3d eye(PathCamera const& camera) { return camera.object_from_camera.translation(); }
Vector3d forward(PathCamera const& camera) { return camera.object_from_camera.linear().col(2); }

/// Level, and the picture's upper side towards up.
void expect_upright(PathCamera const& camera, Vector3d const& up) {
  EXPECT_NEAR(camera.object_from_camera.linear().col(0).dot(up), 0, 1e-12);
  EXPECT_GT(-camera.object_from_camera.linear().col(1).dot(up), 0.99);
}

TEST(WalkPath, TheAngleIsAcrossTheWidth) {
  Camera const camera = walking_camera(640, 480, 90);
  Vector3d const left = camera.ray_direction(-0.5, 239.5), right = camera.ray_direction(639.5, 239.5);
  EXPECT_NEAR(left.normalized().dot(right.normalized()), 0, 1e-12);
}

TEST(WalkPath, AStraightWalkHasEqualStepsAndTurnsEvenly) {
  Vector3d const from(1, 2, 3), to(4, 2.5, -1), up(0, 1, 0), heading(1, 0, 0);
  auto const path = straight_walk(from, to, heading, up, 60, 25, walking_camera(64, 48));
  ASSERT_EQ(path.size(), 25U);
  EXPECT_LT((eye(path.front()) - from).norm(), 1e-12);
  EXPECT_LT((eye(path.back()) - to).norm(), 1e-12);
  for (std::size_t i = 0; i < path.size(); ++i) {
    expect_upright(path[i], up);
    if (i == 0) continue;
    EXPECT_NEAR((eye(path[i]) - eye(path[i - 1])).norm(), (to - from).norm() / 24, 1e-12);
    EXPECT_NEAR(std::acos(forward(path[i]).dot(forward(path[i - 1]))), 60.0 / 24 * std::numbers::pi / 180, 1e-9);
  }
  EXPECT_LT((forward(path.front()) - heading).norm(), 1e-12);
  EXPECT_EQ(straight_walk(from, to, heading, up, 60, 1, walking_camera(64, 48)).size(), 1U);
}

TEST(WalkPath, AWalkThroughPlacesIsEvenlyFastAndUpright) {
  std::vector<Vector3d> const places = {{0, 1, 0}, {2, 1, 0}, {2, 1, 0}, {2, 1, 3}, {2, 4, 3}, {-1, 4, 3}};
  double const length = 2 + 3 + 3 + 3;
  auto const path = walk_through(places, Vector3d::UnitY(), 111, walking_camera(64, 48));
  ASSERT_EQ(path.size(), 111U);
  EXPECT_LT((eye(path.front()) - places.front()).norm(), 1e-12);
  EXPECT_LT((eye(path.back()) - places.back()).norm(), 1e-12);
  double walked = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    ASSERT_TRUE(path[i].object_from_camera.matrix().allFinite());
    expect_upright(path[i], Vector3d::UnitY());
    if (i == 0) continue;
    double const step = (eye(path[i]) - eye(path[i - 1])).norm();
    // Around a corner a step is shorter as the crow flies.
    EXPECT_LE(step, length / 110 + 1e-12);
    walked += step;
  }
  EXPECT_GT(walked, length * (1 - 5.0 / 110));
}

TEST(WalkPath, OnePlaceAndPlacesAboveEachOtherHaveADirectionToo) {
  for (auto const& places : {std::vector<Vector3d>{{1, 2, 3}}, {{1, 2, 3}, {1, 2, 3}}, {{0, 0, 0}, {0, 5, 0}}}) {
    auto const path = walk_through(places, Vector3d::UnitY(), 7, walking_camera(64, 48));
    ASSERT_EQ(path.size(), 7U);
    for (PathCamera const& camera : path) {
      ASSERT_TRUE(camera.object_from_camera.matrix().allFinite());
      expect_upright(camera, Vector3d::UnitY());
    }
  }
  EXPECT_SCANVIEW_ERROR(walk_through({}, Vector3d::UnitY(), 7, walking_camera(64, 48)), ErrorCode::usage, "place");
}

TEST(WalkPath, ATourVisitsEveryPlaceOnceFromTheFirstOn) {
  CounterRandom random(2, 0);
  std::vector<Vector3d> places;
  for (int i = 0; i < 40; ++i) places.emplace_back(random.normal(), random.normal(), random.normal());
  auto const order = tour(places);
  ASSERT_EQ(order.size(), places.size());
  EXPECT_EQ(order.front(), places.front());
  for (Vector3d const& place : places) EXPECT_EQ(std::count(order.begin(), order.end(), place), 1);
  for (std::size_t i = 1; i < order.size(); ++i)
    for (std::size_t j = i; j < order.size(); ++j)
      EXPECT_LE((order[i] - order[i - 1]).norm(), (order[j] - order[i - 1]).norm());
  EXPECT_TRUE(tour({}).empty());
}

TEST(WalkPath, AFilesKeyframesAreJoinedByStraightWays) {
  TemporaryFolder const folder;
  Vector3d const eyes[] = {{5, 0, 0}, {-5, 1, 0}, {0, 0, 4}};
  Json keyframes = Json::array();
  for (Vector3d const& at : eyes) {
    Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
    pose.translation() = at;
    keyframes.push_back({{"object_from_camera", pose_to_json(pose)}});
  }
  write_json(folder.path() / "path.json", {{"format", 1}, {"keyframes", keyframes}, {"between", 10}});
  auto const path = read_walk_path(folder.path() / "path.json", 64, 48);
  ASSERT_EQ(path.size(), 21U);
  for (std::size_t i = 0; i < path.size(); ++i) {
    std::size_t const from = std::min<std::size_t>(i / 10, 1);
    double const t = double(i - 10 * from) / 10;
    EXPECT_LT((eye(path[i]) - ((1 - t) * eyes[from] + t * eyes[from + 1])).norm(), 1e-12) << i;
    EXPECT_EQ(path[i].camera.width(), 64);
    EXPECT_EQ(path[i].camera.height(), 48);
  }
}

}  // namespace
}  // namespace scanview
