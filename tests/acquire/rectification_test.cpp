#include "acquire/rectification.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <optional>

#include "base/random.h"
#include "tests/acquire/light_scene.h"
#include "tests/expect_error.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

double symmetric(CounterRandom& random, double size) { return size * (2 * random.uniform() - 1); }
Eigen::Matrix3d turn(Vector3d const& v) {
  return v.norm() > 0 ? Eigen::AngleAxisd(v.norm(), v.normalized()).toRotationMatrix() : Eigen::Matrix3d::Identity();
}

/// The right camera's centre and axes as the left one sees them.
StereoRig rig_with(Vector3d const& right_eye, Eigen::Matrix3d const& left_from_right = Eigen::Matrix3d::Identity()) {
  StereoRig rig = LightScene().rig;
  rig.right_from_left.linear() = left_from_right.transpose();
  rig.right_from_left.translation() = -left_from_right.transpose() * right_eye;
  return rig;
}

/// The right camera somewhere around the left one, turned up to 0.2 radians about each axis, at most 35° before or
/// behind it.
StereoRig random_rig(std::uint64_t item) {
  CounterRandom random(21, item);
  double const around = 2 * std::numbers::pi * random.uniform();
  Vector3d const eye(90 * std::cos(around), 90 * std::sin(around), symmetric(random, 60));
  Vector3d const turned(symmetric(random, 0.2), symmetric(random, 0.2), symmetric(random, 0.2));
  return rig_with(eye, turn(turned));
}

/// Largest difference of rows, and of depth from disparity relative to the depth, over points that both cameras have
/// before them.
void expect_equal_rows(StereoRig const& rig, Rectification const& r, std::uint64_t item) {
  EXPECT_EQ(r.left.fx(), r.right.fx());
  EXPECT_EQ(r.left.fy(), r.right.fy());
  EXPECT_EQ(r.left.cy(), r.right.cy());
  EXPECT_NEAR(r.baseline, rig.baseline(), 1e-12 * rig.baseline());
  CounterRandom random(22, item);
  for (int i = 0; i < 50; ++i) {
    double const z = 300 + 500 * random.uniform();
    Vector3d const p(symmetric(random, 0.4 * z), symmetric(random, 0.3 * z), z);
    Vector3d const in_left = r.rectified_from_left * p;
    Vector3d const in_right = r.rectified_from_right * (rig.right_from_left * p);
    if (in_left.z() < 50) continue;
    Vector2d const left = r.left.project(in_left), right = r.right.project(in_right);
    // Some twenty operations on numbers of up to 1e3 pixels, in double precision.
    EXPECT_NEAR(left.y(), right.y(), 1e-9);
    double const disparity = (left.x() - r.left.cx()) - (right.x() - r.right.cx());
    EXPECT_GT(disparity, 0);
    EXPECT_NEAR(r.left.fx() * r.baseline / disparity, in_left.z(), 1e-9 * in_left.z());
  }
}

TEST(Rectification, APointHasTheSameRowInBothAndItsDisparityIsItsDepth) {
  int rectified = 0;
  for (std::uint64_t item = 0; item < 60; ++item) {
    SCOPED_TRACE(testing::Message() << "seed 21, item " << item);
    StereoRig const rig = random_rig(item);
    std::optional<Rectification> r;
    try {
      r = rectify(rig);
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::no_solution);
      continue;
    }
    ++rectified;
    for (auto const& rotation : {r->rectified_from_left, r->rectified_from_right}) {
      EXPECT_NEAR((rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).norm(), 0, 1e-12);
      EXPECT_NEAR(rotation.determinant(), 1, 1e-12);
    }
    expect_equal_rows(rig, *r, item);
  }
  EXPECT_GE(rectified, 40);
}

TEST(Rectification, TheRectifiedPicturesHoldAllThatBothCamerasSee) {
  StereoRig const rig = LightScene().rig;
  Rectification const r = rectify(rig);
  CounterRandom random(23, 0);
  for (int i = 0; i < 2000; ++i) {
    Vector2d const pixel(95 * random.uniform(), 71 * random.uniform());
    Vector3d const ray = r.rectified_from_left * rig.left.ray(pixel);
    Vector2d const place = r.left.project(ray);
    // Columns of the right picture are its own; rows without a partner are left out.
    EXPECT_GT(place.x(), -0.5);
    EXPECT_LT(place.x(), r.left.width() - 0.5);
    Vector3d const p = 500 * ray;
    Vector2d const other = rig.right.project(rig.right_from_left * (r.rectified_from_left.transpose() * p));
    if (other.x() < 0 || other.y() < 0 || other.x() > 95 || other.y() > 71) continue;
    EXPECT_TRUE(r.left.contains(place));
    EXPECT_TRUE(r.right.contains(r.right.project(p - Vector3d(r.baseline, 0, 0))));
  }
}

// A pixel of the rectified picture, looked up in the camera's, is the same ray, to what the header promises. A map
// between turned cameras has second derivatives of about 2 s / f, s the slope of the ray, here below 0.5; bilinear over
// 4 pixels each way it is off by 4² / 8 of their sum, 2 × 2 × 0.5 / f.
TEST(Rectification, AMapLeadsToTheRayItCameFrom) {
  for (int const scale : {1, 8}) {
    StereoRig rig = LightScene().rig;
    for (LensCamera* camera : {&rig.left, &rig.right}) camera->camera = camera->camera.resized(96 * scale, 72 * scale);
    Rectification const r = rectify(rig);
    struct Half {
      LensCamera const& camera;
      Camera const& target;
      Eigen::Matrix3d const& target_from_camera;
    };
    for (Half const& half :
         {Half{rig.left, r.left, r.rectified_from_left}, Half{rig.right, r.right, r.rectified_from_right}}) {
      PictureMap const map(half.target, half.target_from_camera, half.camera);
      ASSERT_EQ(map.size(), cv::Size(half.target.width(), half.target.height()));
      int inside = 0;
      std::vector<cv::Vec2f> row;
      for (int y = 0; y < map.size().height; y += scale) {
        map.row(y, row);
        ASSERT_EQ(row.size(), static_cast<std::size_t>(map.size().width));
        for (int x = scale / 4; x < map.size().width; x += scale) {
          cv::Vec2f const place = map.at(x, y);
          EXPECT_EQ(place, row[static_cast<std::size_t>(x)]);
          Vector2d const pixel(place[0], place[1]);
          if (!half.camera.camera.contains(pixel)) continue;
          Vector3d const ray = half.target_from_camera * half.camera.ray(pixel);
          EXPECT_LT((half.target.project(ray) - Vector2d(x, y)).norm(), 2 / half.target.fx()) << x << ' ' << y;
          ++inside;
        }
      }
      EXPECT_GT(inside, 96 * 72 / 2);
    }
  }
}

TEST(Rectification, WhatIsBehindACameraIsNowhereInItsPicture) {
  LensCamera const camera = LightScene().rig.left;
  PictureMap const map(camera.camera, turn({0, std::numbers::pi, 0}), camera);
  std::vector<cv::Vec2f> row;
  for (int y = 0; y < map.size().height; ++y) {
    map.row(y, row);
    for (cv::Vec2f const& place : row) EXPECT_TRUE(std::isnan(place[0]) && std::isnan(place[1]));
  }
}

TEST(Rectification, CamerasThatSwapSidesAreRectifiedAlike) {
  StereoRig const rig = LightScene().rig;
  StereoRig swapped = rig;
  std::swap(swapped.left, swapped.right);
  swapped.right_from_left = rig.right_from_left.inverse();
  expect_equal_rows(swapped, rectify(swapped), 1000);
}

// From side by side to in line: the light moves along the epipolar lines, and rows would converge to a point.
TEST(Rectification, CamerasInLineAreRefusedAndSideBySideAreNot) {
  bool refused = true;
  for (int degrees = 0; degrees <= 90; degrees += 2) {
    double const angle = degrees * std::numbers::pi / 180;
    for (double const ahead : {-1, 1}) {
      SCOPED_TRACE(testing::Message() << degrees << "° off the axis, " << (ahead > 0 ? "before" : "behind"));
      StereoRig const rig = rig_with({120 * std::sin(angle), 0, ahead * 120 * std::cos(angle)});
      if (degrees <= 24) {  // half the picture is 96 / 2 / 110 = tan 24° wide: one camera sees the other's centre
        EXPECT_SCANVIEW_ERROR(rectify(rig), ErrorCode::no_solution, "along the line between them");
        continue;
      }
      try {
        expect_equal_rows(rig, rectify(rig), static_cast<std::uint64_t>(degrees));
        refused = false;
      } catch (Error const& error) {
        EXPECT_EQ(error.code(), ErrorCode::no_solution);
        EXPECT_TRUE(refused) << "after an angle that was accepted";
        EXPECT_LT(degrees, 45);
      }
    }
  }
  EXPECT_SCANVIEW_ERROR(rectify(rig_with({1e-3, 0, 120})), ErrorCode::no_solution, "place the cameras side by side");
}

TEST(Rectification, CamerasWithNoCommonEpipolarLineAreRefused) {
  // Each looks 35° away from the other's plane; half a picture is 18° high.
  EXPECT_SCANVIEW_ERROR(rectify(rig_with({120, 0, 0}, turn({1.2, 0, 0}))), ErrorCode::no_solution,
                        "no common epipolar line");
}

}  // namespace
}  // namespace scanview
