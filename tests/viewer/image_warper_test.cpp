#include "viewer/layered/image_warper.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"
#include "tests/expect_error.h"
#include "viewer/raster/kernels.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

Isometry3d moved(Vector3d const& by) { return Isometry3d(Eigen::Translation3d(by)); }
Isometry3d turned(double angle_rad, Vector3d const& axis, Vector3d const& by) {
  return Eigen::Translation3d(by) * Eigen::AngleAxisd(angle_rad, axis.normalized());
}

Camera eye(int size = 33) { return Camera::perspective(size, size, size, size, (size - 1) / 2.0, (size - 1) / 2.0); }
/// One unit wide and high, as what eye() sees at depth 1.
Camera plate(int size = 33) {
  return Camera::orthographic(size, size, 1.0 / size, 1.0 / size, (size - 1) / 2.0, (size - 1) / 2.0);
}

View empty_view(Camera const& camera, Isometry3d const& object_from_camera = Isometry3d::Identity()) {
  View view;
  view.name = "reference";
  view.image = empty_range_image(camera);
  view.object_from_camera = object_from_camera;
  return view;
}

/// Depths 1 .. 2, some missing, and colours without any order.
View random_view(Camera const& camera, Isometry3d const& object_from_camera, std::uint64_t seed) {
  CounterRandom random(7, seed);
  View view = empty_view(camera, object_from_camera);
  for (float& depth : view.image.depth)
    depth = random.below(8) == 0 ? kMissing : static_cast<float>(1 + random.uniform());
  for (cv::Vec3b& color : view.image.color)
    for (int k = 0; k < 3; ++k) color[k] = static_cast<std::uint8_t>(random.below(256));
  return view;
}

/// One depth in the middle.
View point_view(Camera const& camera, float depth, cv::Vec3b const& color = {10, 20, 30}) {
  View view = empty_view(camera);
  view.image.depth(camera.height() / 2, camera.width() / 2) = depth;
  view.image.color.setTo(color);
  return view;
}

int drawn(Frame const& frame) {
  int count = 0;
  for (int y = 0; y < frame.depth.rows; ++y)
    for (int x = 0; x < frame.depth.cols; ++x) {
      EXPECT_EQ(frame.color(y, x)[3], std::isnan(frame.depth(y, x)) ? 0 : 255);
      count += frame.color(y, x)[3] == 255;
    }
  return count;
}

bool equal(Frame const& a, Frame const& b) {
  auto const same = [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return std::equal(a.color.begin(), a.color.end(), b.color.begin(), b.color.end()) &&
         std::equal(a.depth.begin(), a.depth.end(), b.depth.begin(), b.depth.end(), same);
}

/// The definition, point by point, in double precision.
Frame by_definition(std::vector<View> const& views, Camera const& camera, Isometry3d const& object_from_camera) {
  Frame frame{cv::Mat4b(camera.height(), camera.width(), cv::Vec4b(0, 0, 0, 0)),
              cv::Mat1f(camera.height(), camera.width(), kMissing)};
  for (View const& view : views) {
    RangeImage const& image = view.image;
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x) {
        if (std::isnan(image.depth(y, x))) continue;
        Vector3d const p = object_from_camera.inverse() * (*view.object_from_camera * image.point(x, y));
        if (camera.is_perspective() && p.z() < 1e-5) continue;
        Eigen::Vector2d const center = camera.project(p);
        double const side = image.camera.pixel_size(image.depth(y, x)) / camera.pixel_size(p.z());
        double const half = std::clamp(0.5 * side, 0.5, 32.0);
        auto const from = [&](double at) { return static_cast<int>(std::clamp(std::ceil(at - half), 0.0, 1e5)); };
        auto const to = [&](double at, int size) { return std::min(size - 1.0, std::ceil(at + half) - 1); };
        for (int v = from(center.y()); v <= to(center.y(), camera.height()); ++v)
          for (int u = from(center.x()); u <= to(center.x(), camera.width()); ++u) {
            if (frame.depth(v, u) <= static_cast<float>(p.z())) continue;
            cv::Vec3b const& color = image.color(y, x);
            frame.depth(v, u) = static_cast<float>(p.z());
            frame.color(v, u) = {color[0], color[1], color[2], 255};
          }
      }
  }
  return frame;
}

TEST(ImageWarper, AReferenceFromItsOwnEyeIsItsPicture) {
  Isometry3d const pose = turned(0.7, {1, 2, 3}, {30, -20, 10});
  for (Camera const& camera : {eye(37), plate(37), Camera::perspective(64, 48, 50.3, 51.7, 30.1, 25.9)}) {
    View const view = random_view(camera, pose, 1);
    Frame const frame = ImageWarper({view}).render(camera, pose);
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        float const depth = view.image.depth(y, x);
        cv::Vec3b const color = std::isnan(depth) ? cv::Vec3b(0, 0, 0) : view.image.color(y, x);
        ASSERT_EQ(frame.color(y, x), cv::Vec4b(color[0], color[1], color[2], std::isnan(depth) ? 0 : 255))
            << x << ", " << y;
        ASSERT_TRUE(std::isnan(depth) || std::abs(frame.depth(y, x) - depth) < 1e-6);
      }
  }
}

TEST(ImageWarper, DrawsWhatTheDefinitionSaysBetweenAllCameras) {
  Isometry3d const pose = turned(0.3, {1, -1, 0.5}, {0.4, 0.3, 0.5});
  for (Camera const& from : {eye(40), plate(41)})
    for (Camera const& to : {eye(70), plate(70), Camera::perspective(50, 30, 20, 20, 24, 15)}) {
      std::vector<View> const views = {random_view(from, Isometry3d::Identity(), 2),
                                       random_view(from, turned(-0.2, {0, 1, 0}, {0.1, 0, 0}), 3)};
      Frame const frame = ImageWarper(views).render(to, pose), truth = by_definition(views, to, pose);
      EXPECT_GT(drawn(frame), 300);
      int different = 0;
      for (int y = 0; y < to.height(); ++y)
        for (int x = 0; x < to.width(); ++x)
          different += frame.color(y, x) != truth.color(y, x) || std::abs(frame.depth(y, x) - truth.depth(y, x)) > 1e-5;
      EXPECT_LE(different, 2);  // an edge that single precision puts on the other side of a pixel's centre
    }
}

TEST(ImageWarper, TheNearestIsSeenAndOfEqualsTheFirst) {
  View const far = point_view(eye(), 2, {1, 1, 1}), near = point_view(eye(), 1, {2, 2, 2}),
             equal = point_view(eye(), 1, {3, 3, 3});
  for (auto const& views : {std::vector{far, near, equal}, {near, far, equal}, {near, equal, far}})
    for (int const threads : {1, 2}) {
      Frame const frame = ImageWarper(views, threads).render(eye(), Isometry3d::Identity());
      EXPECT_EQ(drawn(frame), 1);
      EXPECT_EQ(frame.color(16, 16), cv::Vec4b(2, 2, 2, 255));
      EXPECT_FLOAT_EQ(frame.depth(16, 16), 1);
    }
}

TEST(ImageWarper, ASquareGrowsAsTheEyeComesNearer) {
  ImageWarper warper({point_view(eye(), 3)});
  auto const at = [&](double depth) { return warper.render(eye(), moved({0, 0, 3 - depth})); };
  EXPECT_EQ(drawn(at(6)), 1);  // never less than a pixel
  EXPECT_EQ(drawn(at(3)), 1);
  Frame const frame = at(1);
  EXPECT_EQ(drawn(frame), 9);
  for (int y = 15; y <= 17; ++y)
    for (int x = 15; x <= 17; ++x) EXPECT_FLOAT_EQ(frame.depth(y, x), 1);
  EXPECT_EQ(drawn(at(3 / 4.99)), 25);
  // A pixel three times as wide as high stays so.
  View wide = empty_view(Camera::perspective(33, 33, 11, 33, 16, 16));
  wide.image.depth(16, 16) = 1;
  EXPECT_EQ(drawn(ImageWarper({wide}).render(eye(), Isometry3d::Identity())), 3);
}

TEST(ImageWarper, AHugeSquareIsClippedAndCapped) {
  ImageWarper warper({point_view(eye(), 1)});
  EXPECT_EQ(drawn(warper.render(eye(), moved({0, 0, 0.999}))), 33 * 33);
  EXPECT_EQ(drawn(warper.render(eye(201), moved({0, 0, 0.999}))), 64 * 64);
}

TEST(ImageWarper, NothingBehindTheEye) {
  ImageWarper warper({random_view(eye(), Isometry3d::Identity(), 4)});
  EXPECT_EQ(drawn(warper.render(eye(), moved({0, 0, 2}))), 0);
  EXPECT_GT(drawn(warper.render(eye(), moved({0, 0, 1.5}))), 0);
  EXPECT_EQ(drawn(ImageWarper({point_view(eye(), 1)}).render(eye(), moved({0, 0, 1}))), 0);  // in the eye itself
  // An orthographic frame has no eye: depths of either sign, the least in front.
  EXPECT_EQ(drawn(ImageWarper({random_view(plate(), Isometry3d::Identity(), 5)}).render(plate(), moved({0, 0, 5}))),
            drawn(ImageWarper({random_view(plate(), Isometry3d::Identity(), 5)}).render(plate(), moved({0, 0, 0}))));
  Frame const frame = ImageWarper({point_view(plate(), -1, {1, 1, 1}), point_view(plate(), -2, {2, 2, 2})})
                          .render(plate(), Isometry3d::Identity());
  EXPECT_EQ(frame.color(16, 16), cv::Vec4b(2, 2, 2, 255));
  EXPECT_FLOAT_EQ(frame.depth(16, 16), -2);
}

TEST(ImageWarper, WhatIsNoDepthIsLeftOut) {
  float const infinite = std::numeric_limits<float>::infinity();
  for (Camera const& camera : {eye(), plate()}) {
    View view = empty_view(camera);
    float const none[] = {kMissing, infinite, -infinite, kMissing, 0, -1};
    for (int k = 0; k < 6; ++k) view.image.depth(3, 3 + 2 * k) = none[k];
    view.image.depth(3, 2) = view.image.depth(3, 20) = 1;
    // Zero and less are places too for an orthographic camera.
    std::size_t const expected = camera.is_perspective() ? 2 : 4;
    ImageWarper warper({view});
    EXPECT_EQ(warper.points(), expected);
    EXPECT_EQ(static_cast<std::size_t>(drawn(warper.render(camera, Isometry3d::Identity()))), expected);
    view.image.depth.setTo(std::numeric_limits<float>::max());  // finite, and beyond single precision once warped
    drawn(ImageWarper({view}).render(eye(), turned(1, {1, 1, 0}, {1, 0, 0})));
  }
  EXPECT_EQ(drawn(ImageWarper({}).render(eye(), Isometry3d::Identity())), 0);
  EXPECT_EQ(drawn(ImageWarper({empty_view(eye())}).render(eye(), Isometry3d::Identity())), 0);
}

TEST(ImageWarper, ExcludedViewsAreNotSeenUntilTheyAreBack) {
  ImageWarper warper({point_view(eye(), 2, {1, 1, 1}), point_view(eye(), 1, {2, 2, 2})}, 2);
  auto const seen = [&] { return warper.render(eye(), Isometry3d::Identity()).color(16, 16)[0]; };
  warper.exclude({1});
  EXPECT_EQ(seen(), 1);
  EXPECT_EQ(warper.points(), 1U);
  warper.exclude({0, 1});
  EXPECT_EQ(seen(), 0);
  warper.exclude({});
  EXPECT_EQ(seen(), 2);
}

TEST(ImageWarper, EqualOnAnyThreadsAndInstructions) {
  struct AllTargets {
    ~AllTargets() { use_kernel_target(""); }
  } const all_targets;
  std::vector<View> views;
  for (int i = 0; i < 5; ++i)
    views.push_back(random_view(i % 2 ? plate(61) : eye(61), turned(0.3 * i, {0, 1, 0.2}, {0.2 * i, 0, 0.1}), 10 + i));
  views.push_back(views.front());  // every depth of it a tie
  for (Camera const& to : {eye(90), plate(90)}) {
    Isometry3d const pose = turned(0.4, {0.1, 1, 0}, {0.1, 0.1, 0.6});
    Frame const expected = ImageWarper(views, 1).render(to, pose);
    EXPECT_GT(drawn(expected), 1000);
    for (char const* const target : kernel_targets()) {
      use_kernel_target(target);
      for (int const threads : {1, 2, 3})
        EXPECT_TRUE(equal(ImageWarper(views, threads).render(to, pose), expected)) << target;
    }
    use_kernel_target("");
  }
}

TEST(ImageWarper, SaysWhichViewCannotBeWarped) {
  View view = point_view(eye(), 1);
  view.object_from_camera.reset();
  EXPECT_SCANVIEW_ERROR(ImageWarper({view}), ErrorCode::bad_input, "reference has no pose");
  view = point_view(eye(), 1);
  view.image.color.release();
  EXPECT_SCANVIEW_ERROR(ImageWarper({view}), ErrorCode::bad_input, "view reference");
}

}  // namespace
}  // namespace scanview
