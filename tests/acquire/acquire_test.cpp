#include "acquire/acquire.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <thread>

#include "acquire/frame_stream.h"
#include "tests/acquire/light_scene.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

using Decoder = AcquireOptions::Decoder;

/// A Gray capture's share is a column counted from 0 to 2^bits, a sweep's a step from 0 to steps - 1: depth does not
/// care.
RangeImage acquired(LightScene const& scene, LightOptions const& light, GrayKind gray = GrayKind::none,
                    Decoder decoder = Decoder::space_time, int threads = 0) {
  TemporaryFolder const folder;
  Capture const capture = write_capture(folder.path(), scene, light, gray);
  AcquireOptions options;
  options.decoder = decoder;
  Context context;
  context.threads = threads;
  return acquire(capture, options, context).set.views.front().image;
}

/// The stated deviation must hold to a fifth either way. Of the depths `most_wrong` may be off by more than five of
/// them, and `least` of the pixels that both cameras see have one.
void expect_honest(RangeImage const& image, LightScene const& scene, int radius, double least = 0.97,
                   double most_wrong = 0.002) {
  DepthErrors const errors = depth_errors(image, scene, scene.smooth_part(radius));
  SCOPED_TRACE(testing::Message() << errors.depths << " of " << errors.pixels << ", error / sigma " << errors.ratio
                                  << ", wrong " << errors.wrong);
  auto const depths = static_cast<double>(errors.depths);
  EXPECT_GT(errors.pixels, 1000U);
  EXPECT_GE(depths, least * static_cast<double>(errors.pixels));
  EXPECT_GT(errors.ratio, 0.8);
  EXPECT_LT(errors.ratio, 1.25);
  EXPECT_LE(errors.wrong, most_wrong);
}

TEST(Acquire, ASweepsDepthsAreAsGoodAsTheySay) {
  for (auto const shape : {LightScene::Shape::plane, LightScene::Shape::sphere, LightScene::Shape::step}) {
    LightScene scene;
    scene.shape = shape;
    SCOPED_TRACE(static_cast<int>(shape));
    expect_honest(acquired(scene, {}), scene, 2);
  }
}

TEST(Acquire, TheStripeDecodersDepthsAreAsGoodAsTheySay) {
  // Depths are where a stripe's middle is: 31 of them on some 90 pixels of a row.
  LightScene scene;
  // Of so few depths 0.2 % are two: three Poisson deviations more may be wrong by chance, 2 + 3 sqrt(2) = 6.
  expect_honest(acquired(scene, {}, GrayKind::none, Decoder::stripe), scene, 3, 0.25, 0.006);
}

TEST(Acquire, LightAlongTheEpipolarLinesIsRefused) {
  LightScene scene;
  scene.along_rows = true;
  EXPECT_SCANVIEW_ERROR(acquired(scene, {}), ErrorCode::no_solution, "along the epipolar lines");
  EXPECT_SCANVIEW_ERROR(acquired(scene, {}, GrayKind::inverses), ErrorCode::no_solution, "along the epipolar lines");
}

TEST(Acquire, AGrayCodesDepthsAreAsGoodAsTheySay) {
  for (auto const kind : {GrayKind::inverses, GrayKind::levels}) {
    LightScene scene;
    SCOPED_TRACE(static_cast<int>(kind));
    expect_honest(acquired(scene, {}, kind), scene, 3);
  }
}

TEST(Acquire, SixteenBitsAreAsGoodAsTheySay) {
  LightScene scene;
  LightOptions light;
  light.is_16_bit = true;
  expect_honest(acquired(scene, light), scene, 2);
  expect_honest(acquired(scene, light, GrayKind::inverses), scene, 3);
}

bool same_bytes(cv::Mat const& a, cv::Mat const& b) {
  return a.size() == b.size() && a.type() == b.type() &&
         std::equal(a.datastart, a.dataend, b.datastart, b.dataend);  // NaN as well
}

TEST(Acquire, ThreadsDoNotChangeAByte) {
  LightScene scene;
  for (auto const kind : {GrayKind::none, GrayKind::inverses})
    for (auto const decoder : {Decoder::space_time, Decoder::stripe}) {
      if (kind == GrayKind::inverses && decoder == Decoder::stripe) continue;  // of a sweep only
      RangeImage const one = acquired(scene, {}, kind, decoder, 1), two = acquired(scene, {}, kind, decoder, 2);
      EXPECT_TRUE(same_bytes(one.depth, two.depth));
      EXPECT_TRUE(same_bytes(one.sigma, two.sigma));
      EXPECT_TRUE(same_bytes(one.classes, two.classes));
      EXPECT_TRUE(same_bytes(one.color, two.color));
    }
}

TEST(FrameStream, FramesComeInOrderAndFewLiveAtOnce) {
  for (int const threads : {1, 2}) {
    Context context;
    context.threads = threads;
    std::atomic<int> read = 0, most = 0;
    int used = 0;
    stream_frames(
        context, 200,
        [&](std::size_t i) {
          if (i % 7 == 0) std::this_thread::yield();
          ++read;
          return cv::Mat(cv::Mat1b(4, 4, static_cast<std::uint8_t>(i)));
        },
        [&](std::size_t i, cv::Mat const& frame) {
          EXPECT_EQ(i, static_cast<std::size_t>(used));
          EXPECT_EQ(frame.at<std::uint8_t>(0, 0), i);
          most = std::max<int>(most, read - used);
          ++used;
        });
    EXPECT_EQ(used, 200);
    EXPECT_LE(most, threads + 2);
  }
}

TEST(FrameStream, TheFirstErrorIsRethrownAndNothingAfterItIsUsed) {
  for (int const threads : {1, 2}) {
    Context context;
    context.threads = threads;
    std::size_t used = 0;
    auto const stream = [&] {
      stream_frames(
          context, 50,
          [](std::size_t i) {
            if (i == 20 || i == 21) throw Error(ErrorCode::bad_input, {}, "frame " + std::to_string(i));
            return cv::Mat(cv::Mat1b(2, 2));
          },
          [&](std::size_t, cv::Mat const&) { ++used; });
    };
    EXPECT_SCANVIEW_ERROR(stream(), ErrorCode::bad_input, "frame 20");
    EXPECT_EQ(used, 20U);
    EXPECT_SCANVIEW_ERROR(stream_frames(
                              context, 9, [](std::size_t) { return cv::Mat(cv::Mat1b(2, 2)); },
                              [](std::size_t i, cv::Mat const&) {
                                if (i == 5) throw Error(ErrorCode::io, {}, "use 5");
                              }),
                          ErrorCode::io, "use 5");
  }
}

}  // namespace
}  // namespace scanview
