#include "viewer/walkthrough/gap_interpolation.h"

#include <gtest/gtest.h>

#include <cmath>

#include "acquire/range_image.h"
#include "base/random.h"

namespace scanview {
namespace {

cv::Vec4b const kNear(20, 40, 200, 255), kFar(180, 90, 30, 255);

Frame empty_frame(int width, int height) {
  Frame frame;
  frame.color = cv::Mat4b(height, width, cv::Vec4b(0, 0, 0, 0));
  frame.depth = cv::Mat1f(height, width, kMissing);
  return frame;
}

TEST(GapInterpolation, KeepsWhatWasDrawnAndLeavesNoGap) {
  CounterRandom random(1, 0);
  for (auto const& size : {cv::Size(1, 1), cv::Size(2, 1), cv::Size(37, 23), cv::Size(64, 64), cv::Size(1, 50)}) {
    Frame frame = empty_frame(size.width, size.height);
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        if (random.uniform() < 0.7 && (x > 0 || y > 0)) continue;
        frame.color(y, x) = {uchar(random.below(256)), uchar(random.below(256)), uchar(random.below(256)), 255};
        frame.depth(y, x) = float(1 + random.uniform());
      }
    Frame const before{frame.color.clone(), frame.depth.clone()};
    interpolate_gaps(frame);
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        ASSERT_EQ(frame.color(y, x)[3], 255);
        // A mean of depths between 1 and 2.
        ASSERT_GE(frame.depth(y, x), 1 - 1e-6F);
        ASSERT_LE(frame.depth(y, x), 2 + 1e-6F);
        if (before.color(y, x)[3] == 0) continue;
        ASSERT_EQ(frame.color(y, x), before.color(y, x));
        ASSERT_EQ(frame.depth(y, x), before.depth(y, x));
      }
  }
}

TEST(GapInterpolation, AnEmptyFrameStaysEmpty) {
  for (auto const& size : {cv::Size(1, 1), cv::Size(33, 7)}) {
    Frame frame = empty_frame(size.width, size.height);
    interpolate_gaps(frame);
    for (auto const& c : frame.color) ASSERT_EQ(c, cv::Vec4b(0, 0, 0, 0));
    for (float const z : frame.depth) ASSERT_TRUE(std::isnan(z));
  }
}

TEST(GapInterpolation, TheFarGoesOnBehindTheNear) {
  // Wherever a gap between them lies and however wide it is, all of it is far.
  for (int first = 5; first < 20; ++first)
    for (int wide = 1; wide < 9; ++wide) {
      Frame frame = empty_frame(40, 12);
      for (int y = 0; y < 12; ++y)
        for (int x = 0; x < 40; ++x) {
          if (x >= first && x < first + wide) continue;
          frame.color(y, x) = x < first ? kNear : kFar;
          frame.depth(y, x) = x < first ? 1.0F : 10.0F;
        }
      interpolate_gaps(frame);
      for (int y = 0; y < 12; ++y)
        for (int x = first; x < first + wide; ++x) {
          // Means of equal colours, rounded in single precision.
          for (int c = 0; c < 3; ++c) ASSERT_NEAR(frame.color(y, x)[c], kFar[c], 1) << first << '+' << wide << ' ' << x;
          ASSERT_NEAR(frame.depth(y, x), 10, 1e-4);
        }
    }
}

TEST(GapInterpolation, BetweenTwoColoursOfOneDepthItIsBetweenThem) {
  Frame frame = empty_frame(16, 1);
  for (int x = 0; x < 16; ++x) {
    if (x >= 6 && x < 10) continue;
    frame.color(0, x) = x < 6 ? cv::Vec4b(50, 50, 50, 255) : cv::Vec4b(200, 200, 200, 255);
    frame.depth(0, x) = 3;
  }
  interpolate_gaps(frame);
  for (int x = 6; x < 10; ++x) {
    EXPECT_GE(frame.color(0, x)[0], frame.color(0, x - 1)[0]);
    EXPECT_LE(frame.color(0, x)[0], frame.color(0, x + 1)[0]);
    EXPECT_EQ(frame.depth(0, x), 3);
  }
}

}  // namespace
}  // namespace scanview
