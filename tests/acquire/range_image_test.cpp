#include "acquire/range_image.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

namespace scanview {
namespace {

/// A plane n·p = d seen by a camera.
RangeImage plane_image(Camera const& camera, Eigen::Vector3d const& n, double d) {
  RangeImage image = empty_range_image(camera);
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      Eigen::Vector3d const origin = camera.ray_origin(x, y), direction = camera.ray_direction(x, y);
      double const z = (d - n.dot(origin)) / n.dot(direction);  // direction.z is 1: the parameter is the depth
      image.depth(y, x) = static_cast<float>(z);
      image.sigma(y, x) = 1e-4F;
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
    }
  return image;
}

TEST(RangeImage, NormalsOfAPlaneAreThePlanes) {
  Eigen::Vector3d const n = Eigen::Vector3d(0.3, -0.4, -1).normalized();
  for (Camera const& camera :
       {Camera::perspective(40, 30, 50, 50, 20, 15), Camera::orthographic(40, 30, 0.02, 0.02, 20, 15)}) {
    RangeImage image = plane_image(camera, n, -2);
    ASSERT_NO_THROW(image.check());
    cv::Mat3f const normals = estimate_normals(image);
    for (int y = 0; y < 30; ++y)
      for (int x = 0; x < 40; ++x) {
        Eigen::Vector3d const found(normals(y, x)[0], normals(y, x)[1], normals(y, x)[2]);
        // A float depth of 2 is good to 1.2e-7 over a neighbourhood about 0.1 wide: 1e-5 is generous.
        EXPECT_LT((found - n).norm(), 1e-5);
      }
  }
}

TEST(RangeImage, NormalsDoNotBridgeSteps) {
  Camera const camera = Camera::orthographic(40, 30, 0.02, 0.02, 20, 15);
  RangeImage image = plane_image(camera, Eigen::Vector3d(0, 0, -1), -2);
  cv::Mat(image.depth.colRange(20, 40)) += 1.0;
  cv::Mat3f const normals = estimate_normals(image);
  for (int x = 0; x < 40; ++x) EXPECT_NEAR(normals(15, x)[2], -1, 1e-5);
}

TEST(RangeImage, NormalsOfTooLittleAreMissing) {
  RangeImage image = plane_image(Camera::orthographic(9, 9, 1, 1, 4, 4), Eigen::Vector3d(0, 0, -1), -2);
  for (int y = 0; y < 9; ++y)
    for (int x = 0; x < 9; ++x)
      if (y != 4) image.remove(x, y, PixelClass::background);  // a line of pixels
  cv::Mat3f const normals = estimate_normals(image);
  for (int x = 0; x < 9; ++x) EXPECT_TRUE(std::isnan(normals(4, x)[0]));
}

TEST(RangeImage, CheckFindsWhatDoesNotAgree) {
  RangeImage const good = plane_image(Camera::orthographic(5, 5, 1, 1, 2, 2), Eigen::Vector3d(0, 0, -1), -2);
  EXPECT_EQ(good.count_depths(), 25U);
  auto const broken = [&](auto change) {
    RangeImage image = good;
    image.depth = good.depth.clone();
    image.sigma = good.sigma.clone();
    image.classes = good.classes.clone();
    change(image);
    return image;
  };
  EXPECT_THROW(broken([](RangeImage& i) { i.depth(1, 1) = kMissing; }).check(), std::logic_error);
  EXPECT_THROW(broken([](RangeImage& i) { i.sigma(1, 1) = 0; }).check(), std::logic_error);
  EXPECT_THROW(broken([](RangeImage& i) { i.classes(1, 1) = 0; }).check(), std::logic_error);
  EXPECT_THROW(broken([](RangeImage& i) { i.depth = cv::Mat1f(4, 5, 1.0F); }).check(), std::logic_error);
  EXPECT_NO_THROW(broken([](RangeImage& i) { i.remove(1, 1, PixelClass::cut); }).check());
}

}  // namespace
}  // namespace scanview
