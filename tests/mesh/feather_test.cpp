#include "mesh/feather.h"

#include <gtest/gtest.h>

#include "tests/mesh/depth_maps.h"

namespace scanview {
namespace {

using namespace testing;

TEST(Feather, RisesLinearlyWithTheDistanceFromTheBoundary) {
  auto const depth = [](int x, int y) {
    return x >= 10 && x < 80 && y >= 10 && y < 70 ? 2.0 : std::numeric_limits<double>::quiet_NaN();
  };
  RangeImage const image = depth_map(small_camera(), 1e-3, depth);
  cv::Mat1b const covered = image.classes.clone();
  cv::Mat1b mask = covered == 255;
  cv::Mat1b const feather = feather_weights(mask, find_surface_links(image, 6, 1), 16);
  EXPECT_EQ(feather(9, 40), 0);
  for (int k = 0; k < 16; ++k) EXPECT_NEAR(feather(10 + k, 45), 255 * (k + 0.5) / 16, 0.51) << k;
  EXPECT_EQ(feather(40, 45), 255);
}

TEST(Feather, FadesToBothSidesOfAStepAndToThePicturesEdge) {
  auto const depth = [](int x, int) { return x < 48 ? 2.0 : 3.0; };
  RangeImage const image = depth_map(small_camera(), 1e-3, depth);
  cv::Mat1b const covered(image.depth.size(), uchar(255));
  cv::Mat1b const feather = feather_weights(covered, find_surface_links(image, 6, 1), 16);
  for (int k = 0; k < 16; ++k) {
    EXPECT_NEAR(feather(40, 47 - k), 255 * (k + 0.5) / 16, 0.51);
    EXPECT_NEAR(feather(40, 48 + k), 255 * (k + 0.5) / 16, 0.51);
    EXPECT_NEAR(feather(40, k), 255 * (k + 0.5) / 16, 0.51);
    EXPECT_NEAR(feather(k, 24), 255 * (k + 0.5) / 16, 0.51);
  }
}

}  // namespace
}  // namespace scanview
