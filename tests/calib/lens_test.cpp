#include "calib/lens.h"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/expect_error.h"

namespace scanview {
namespace {

Lens const kLens{-0.2, 0.05, 0.001, -0.002, 0.01, 0, 0, 0};
Camera const kCamera = Camera::perspective(320, 240, 300, 300, 159.5, 119.5);

TEST(Lens, DistortionByHand) {
  // r² = 0.05; radial = 1 - 0.2·0.05 + 0.05·0.0025 + 0.01·0.000125
  double const radial = 1 - 0.01 + 0.000125 + 0.00000125;
  double const x = 0.2 * radial + 2 * 0.001 * 0.2 * 0.1 - 0.002 * (0.05 + 2 * 0.04);
  double const y = 0.1 * radial + 0.001 * (0.05 + 2 * 0.01) - 2 * 0.002 * 0.2 * 0.1;
  EXPECT_TRUE(kLens.distort({0.2, 0.1}).isApprox(Eigen::Vector2d(x, y), 1e-14));
}

TEST(Lens, UndistortIsTheInverse) {
  Lens const rational{-0.3, 0.2, 0.001, -0.002, 0.05, 0.1, -0.05, 0.02};
  for (Lens const& lens : {kLens, rational})
    for (double x = -0.6; x <= 0.6; x += 0.1)
      for (double y = -0.45; y <= 0.45; y += 0.09)
        EXPECT_LT((lens.undistort(lens.distort({x, y})) - Eigen::Vector2d(x, y)).norm(), 1e-12) << x << " " << y;
}

TEST(Lens, BeyondTheFoldThereIsNoInverse) {
  // r (1 - r²) is largest, 0.385, at r = 0.577: nothing is imaged farther out.
  Lens const barrel{-1, 0, 0, 0, 0, 0, 0, 0};
  EXPECT_TRUE(barrel.undistort({0.5, 0}).hasNaN());
  EXPECT_NEAR(barrel.undistort({0.375, 0}).x(), 0.5, 1e-12);
}

TEST(Lens, UndistortedPictureIsTheIdealOne) {
  // A smooth function of the ideal ray, photographed through the lens, comes back as that function.
  auto const value = [](Eigen::Vector2d const& p) { return 128 + 60 * std::sin(8 * p.x()) + 50 * std::cos(9 * p.y()); };
  cv::Mat3b distorted(240, 320);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      Eigen::Vector2d const seen = kCamera.ray_direction(x, y).head<2>();
      Eigen::Vector2d const ideal = kLens.undistort(seen);
      distorted(y, x) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(value(ideal)));
    }
  cv::Mat3b const ideal = undistort_color(distorted, kCamera, kLens);
  double worst = 0;
  for (int y = 20; y < 220; ++y)
    for (int x = 20; x < 300; ++x)
      worst = std::max(worst, std::abs(ideal(y, x)[0] - value(kCamera.ray_direction(x, y).head<2>())));
  // Two roundings (±0.5 each) and bilinear interpolation's h²/8·|f''| = (1/300)²/8·(64·60 + 81·50) < 0.02.
  EXPECT_LT(worst, 1.05);
}

TEST(Lens, DepthsAreNotMixed) {
  cv::Mat1f depth(240, 320, 1.0F);
  depth.colRange(160, 320) = 2.0F;
  cv::Mat1f const ideal = undistort_depth(depth, kCamera, kLens);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) EXPECT_TRUE(ideal(y, x) == 1 || ideal(y, x) == 2 || std::isnan(ideal(y, x)));
}

TEST(Lens, AnIdealLensCopies) {
  cv::Mat1f const depth(4, 4, 1.0F);
  EXPECT_EQ(undistort_depth(depth, kCamera, {}).data, depth.data);
}

TEST(Lens, BadJsonIsNamed) {
  EXPECT_SCANVIEW_ERROR(Lens::from_json(Json::array({1, 2, 3}), "f"), ErrorCode::bad_input, "distortion");
  EXPECT_SCANVIEW_ERROR(Lens::from_json(Json::array({1, 2, 3, "x"}), "f"), ErrorCode::bad_input, "no number");
  EXPECT_EQ(Lens::from_json(Json::array({1, 2, 3, 4}), "f").k3, 0);
  EXPECT_EQ(Lens::from_json(Json::array({1, 2, 3, 4, 5, 6, 7, 8}), "f").k6, 8);
}

}  // namespace
}  // namespace scanview
