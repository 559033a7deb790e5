#include "viewer/blend/supersampling.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/expect_error.h"

namespace scanview {
namespace {

/// Left of a slanted line one colour, nothing right of it; a checkerboard of single pixels inside, so that blur shows.
class HalfPlane : public Renderer {
 public:
  Frame render(Camera const& camera, Eigen::Isometry3d const&) override {
    Frame frame{cv::Mat4b(camera.height(), camera.width(), cv::Vec4b(0, 0, 0, 0)),
                cv::Mat1f(camera.height(), camera.width(), std::numeric_limits<float>::quiet_NaN())};
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        Eigen::Vector3d const ray = camera.ray_direction(x, y);
        if (ray.x() + 0.3 * ray.y() > 0.01) continue;
        auto const tone = static_cast<std::uint8_t>((x + y) % 2 ? 200 : 50);
        frame.color(y, x) = {tone, tone, tone, 255};
        frame.depth(y, x) = 2;
      }
    return frame;
  }
};

Camera const kCamera = Camera::perspective(40, 30, 50, 50, 19.5, 14.5);

TEST(Supersampling, InsideNothingChangesAndBordersAreMixtures) {
  HalfPlane plain;
  SupersamplingRenderer smooth(plain, 4);
  Frame const sharp = plain.render(kCamera, {}), soft = smooth.render(kCamera, {});
  int mixtures = 0;
  double drawn = 0;
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 40; ++x) {
      int const alpha = soft.color(y, x)[3];
      drawn += alpha / 255.0;
      mixtures += alpha > 0 && alpha < 255;
      if (alpha == 255) {
        EXPECT_EQ(soft.color(y, x), sharp.color(y, x));
      }
      EXPECT_EQ(alpha == 0, std::isnan(soft.depth(y, x)));
    }
  EXPECT_GT(mixtures, 20);
  // The area left of x + 0.3 y = 0.01 in normalised coordinates: columns up to 19.5 + 50 (0.01 - 0.3 y), mean over the
  // rows 20.5 pixels; 4 x 4 samples know an edge to an eighth of a pixel a row.
  EXPECT_NEAR(drawn, 30 * 20.5, 30 * 0.125);
}

TEST(Supersampling, BlackBackgroundDoesNotBleedIn) {
  Frame frame{cv::Mat4b(2, 2, cv::Vec4b(0, 0, 0, 0)), cv::Mat1f(2, 2, std::numeric_limits<float>::quiet_NaN())};
  frame.color(0, 1) = {180, 90, 30, 255};
  frame.depth(0, 1) = 3;
  Frame const small = box_filtered(frame, 2);
  EXPECT_EQ(small.color(0, 0), cv::Vec4b(180, 90, 30, 64));  // a quarter of 255
  EXPECT_EQ(small.depth(0, 0), 3);
}

TEST(Supersampling, TheFactorIsBounded) {
  HalfPlane plain;
  EXPECT_SCANVIEW_ERROR(SupersamplingRenderer(plain, 0), ErrorCode::usage, "supersampling");
  EXPECT_SCANVIEW_ERROR(SupersamplingRenderer(plain, 9), ErrorCode::usage, "supersampling");
}

}  // namespace
}  // namespace scanview
