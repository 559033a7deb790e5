#include "calib/camera.h"

#include <gtest/gtest.h>

#include <limits>

#include "base/random.h"
#include "tests/expect_error.h"

namespace scanview {
namespace {

double const nan = std::numeric_limits<double>::quiet_NaN();

Camera const kPerspective = Camera::perspective(640, 480, 600, 610, 319.5, 239.5);
Camera const kOrthographic = Camera::orthographic(400, 300, 0.25, 0.5, 200, 150);

TEST(Camera, ProjectionByHand) {
  // u = 600 * 0.2 / 2 + 319.5, v = 610 * -0.1 / 2 + 239.5
  EXPECT_TRUE(kPerspective.project({0.2, -0.1, 2}).isApprox(Eigen::Vector2d(379.5, 209.0), 1e-12));
  // u = 5 / 0.25 + 200, v = 5 / 0.5 + 150
  EXPECT_TRUE(kOrthographic.project({5, 5, -7}).isApprox(Eigen::Vector2d(220, 160), 1e-12));
}

TEST(Camera, UnprojectInvertsProject) {
  for (Camera const& camera : {kPerspective, kOrthographic})
    for (std::uint64_t i = 0; i < 1000; ++i) {
      CounterRandom random(1, i);
      double const u = 640 * random.uniform(), v = 480 * random.uniform(), z = 0.1 + 10 * random.uniform();
      Eigen::Vector3d const p = camera.unproject(u, v, z);
      EXPECT_EQ(p.z(), z);
      EXPECT_TRUE(camera.project(p).isApprox(Eigen::Vector2d(u, v), 1e-12));
      Eigen::Vector3d const on_ray =
          camera.ray_origin(u, v) + (z - camera.ray_origin(u, v).z()) * camera.ray_direction(u, v);
      EXPECT_TRUE(on_ray.isApprox(p, 1e-12));
    }
}

TEST(Camera, BehindAPerspectiveCameraThereIsNoPixel) {
  EXPECT_TRUE(kPerspective.project({1, 1, 0}).array().isNaN().all());
  EXPECT_TRUE(kPerspective.project({1, 1, -1}).array().isNaN().all());
  EXPECT_FALSE(kPerspective.contains(kPerspective.project({0, 0, -1})));
}

TEST(Camera, ResizingKeepsPixelAreas) {
  for (Camera const& camera : {kPerspective, kOrthographic}) {
    Camera const half = camera.resized(camera.width() / 2, camera.height() / 2);
    Eigen::Vector3d const p(0.3, 0.2, 3);
    Eigen::Vector2d const shift(0.5, 0.5);
    EXPECT_TRUE((2 * (half.project(p) + shift)).isApprox(camera.project(p) + shift, 1e-12));
    EXPECT_NEAR(half.pixel_size(3), 2 * camera.pixel_size(3), 1e-12);
  }
}

TEST(Camera, JsonRoundTripsBitByBit) {
  for (Camera const& camera : {kPerspective, kOrthographic, Camera::orthographic(3, 3, 0.1 / 3, 7e-9, 1, 1)})
    EXPECT_EQ(Camera::from_json(Json::parse(camera.to_json().dump()), "f"), camera);
}

TEST(Camera, BadJsonIsNamed) {
  Json const good = kPerspective.to_json();
  for (char const* key : {"model", "width", "height", "fx", "fy", "cx", "cy"}) {
    Json bad = good;
    bad.erase(key);
    EXPECT_SCANVIEW_ERROR(Camera::from_json(bad, "f.json"), ErrorCode::bad_input, key);
  }
  Json bad = good;
  bad["skew"] = 0;
  EXPECT_SCANVIEW_ERROR(Camera::from_json(bad, "f.json"), ErrorCode::bad_input, "skew");
  bad = good;
  bad["fx"] = -600;
  EXPECT_SCANVIEW_ERROR(Camera::from_json(bad, "f.json"), ErrorCode::bad_input, "positive");
  bad = good;
  bad["width"] = 4e9;
  EXPECT_SCANVIEW_ERROR(Camera::from_json(bad, "f.json"), ErrorCode::bad_input, "width");
  EXPECT_SCANVIEW_ERROR(Camera::perspective(0, 5, 1, 1, 0, 0), ErrorCode::bad_input, "size");
  EXPECT_SCANVIEW_ERROR(Camera::perspective(5, 5, 1, nan, 0, 0), ErrorCode::bad_input, "positive");
  EXPECT_SCANVIEW_ERROR(Camera::orthographic(5, 5, 0, 1, 0, 0), ErrorCode::bad_input, "positive");
}

TEST(Pose, JsonRoundTripsBitByBit) {
  Eigen::Isometry3d pose(Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()));
  pose.translation() << 0.1, -1e6, 1e-9;
  EXPECT_EQ(pose_from_json(Json::parse(pose_to_json(pose).dump()), "f", "pose").matrix(), pose.matrix());
}

TEST(Pose, FourDigitsAreMadeARotation) {
  Eigen::Matrix4d matrix = Eigen::Isometry3d(Eigen::AngleAxisd(0.7, Eigen::Vector3d::UnitY())).matrix();
  matrix = (matrix * 1e4).array().round() / 1e4;
  Eigen::Matrix3d const r = pose_from_matrix(matrix, "f", "pose").linear();
  EXPECT_TRUE((r.transpose() * r).isApprox(Eigen::Matrix3d::Identity(), 1e-14));
}

TEST(Pose, WhatIsNoRigidMotionIsRefused) {
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  matrix(0, 0) = -1;  // mirrored
  EXPECT_SCANVIEW_ERROR(pose_from_matrix(matrix, "f", "pose of view 3"), ErrorCode::bad_input,
                        "pose of view 3 is no rotation");
  matrix(0, 0) = 2;
  EXPECT_SCANVIEW_ERROR(pose_from_matrix(matrix, "f", "pose"), ErrorCode::bad_input, "no rotation");
  matrix = Eigen::Matrix4d::Identity();
  matrix(1, 3) = nan;
  EXPECT_SCANVIEW_ERROR(pose_from_matrix(matrix, "f", "pose"), ErrorCode::bad_input, "not finite");
  matrix = Eigen::Matrix4d::Identity();
  matrix(3, 3) = 0;
  EXPECT_SCANVIEW_ERROR(pose_from_matrix(matrix, "f", "pose"), ErrorCode::bad_input, "last row");
  EXPECT_SCANVIEW_ERROR(pose_from_json(Json::array({1, 2}), "f", "pose"), ErrorCode::bad_input, "16 numbers");
  EXPECT_SCANVIEW_ERROR(pose_from_json("x", "f", "pose"), ErrorCode::bad_input, "16 numbers");
}

}  // namespace
}  // namespace scanview
