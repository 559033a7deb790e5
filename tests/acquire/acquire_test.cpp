#include "acquire/acquire.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <functional>
#include <thread>

#include "acquire/frame_stream.h"
#include "base/image_file.h"
#include "tests/acquire/light_scene.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
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

/// The same with what else was said, after a change of the folder's pictures.
AcquireResult result_of(LightScene const& scene, LightOptions const& light, GrayKind gray,
                        std::function<void(Capture const&)> const& change = {}) {
  TemporaryFolder const folder;
  Capture const capture = write_capture(folder.path(), scene, light, gray);
  if (change) change(capture);
  Context context;
  return acquire(capture, {}, context);
}
fs::path frame(Capture const& capture, Side side, int k) { return capture.frame_path("view_000", side, k); }
bool is_warned(AcquireResult const& result, std::string const& text) {
  auto const& warnings = result.views.front().warnings;
  return std::any_of(warnings.begin(), warnings.end(),
                     [&](std::string const& warning) { return warning.find(text) != std::string::npos; });
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

/// No depth may be further off than its sigma lets expect, even where sigma may say more than that.
void expect_nothing_wrong(AcquireResult const& result, LightScene const& scene, double least) {
  DepthErrors const errors = depth_errors(result.set.views.front().image, scene, scene.smooth_part(2));
  EXPECT_GE(static_cast<double>(errors.depths), least * static_cast<double>(errors.pixels));
  EXPECT_LT(errors.ratio, 1.25);
  EXPECT_LE(errors.wrong, 0.002);
}

TEST(Acquire, ABeamNarrowerThanAPixelClaimsNoMoreThanItKnows) {
  // 1.7 light steps a pixel: a standard deviation of half a pixel.
  LightScene const scene;
  LightOptions light;
  light.steps = 192;
  light.beam = 0.8;
  expect_nothing_wrong(result_of(scene, light, GrayKind::none), scene, 0.97);
}

TEST(Acquire, ABeamNarrowerThanTheStepIsWarnedOf) {
  LightScene const scene;
  LightOptions light;
  light.beam = 0.3;
  AcquireResult const result = result_of(scene, light, GrayKind::none);
  EXPECT_TRUE(is_warned(result, "too narrow to tell where it was between two frames"));
  expect_nothing_wrong(result, scene, 0.5);
  EXPECT_FALSE(is_warned(result_of(scene, {}, GrayKind::none), "too narrow"));
}

TEST(Acquire, CamerasUnderLessThanADegreeAreWarnedOfAndSigmaSaysSo) {
  LightScene scene;
  scene.shape = LightScene::Shape::plane;
  scene.rig.right_from_left = Eigen::Isometry3d::Identity();
  scene.rig.right_from_left.translation().x() = -8;  // at 580 mm: 0.8°
  AcquireResult const result = result_of(scene, {}, GrayKind::none);
  EXPECT_LT(result.views.front().angle_deg, 1);
  EXPECT_TRUE(is_warned(result, "depths are uncertain, as sigma says"));
  EXPECT_GT(result.views.front().sigma_median, 5);  // under 15° it is 0.7
  expect_honest(result.set.views.front().image, scene, 2);
}

/// One camera's picture stored over another one's place, or both exchanged.
struct FrameFault {
  int from, to;
  bool exchanged;
  std::vector<Side> sides;

  void operator()(Capture const& capture) const {
    for (Side const side : sides) {
      std::string const first = read_file(frame(capture, side, from)), second = read_file(frame(capture, side, to));
      write_file(frame(capture, side, to), first);
      if (exchanged) write_file(frame(capture, side, from), second);
    }
  }
};
std::vector<std::vector<Side>> const kOneSideOrBoth = {{Side::left}, {Side::left, Side::right}};

// A peak with a frame out of place is none that light makes: the pixels lit then are refused, or their sigma holds.
TEST(Acquire, ADoubledOrSwappedFrameOfASweepIsNamedAndItsPixelsGo) {
  LightScene const scene;
  for (auto const& sides : kOneSideOrBoth) {
    AcquireResult const doubled = result_of(scene, {}, GrayKind::none, FrameFault{15, 16, false, sides});
    EXPECT_TRUE(is_warned(doubled, "left: frame 16 shows the same light as the one before"));
    expect_nothing_wrong(doubled, scene, 0.6);
    AcquireResult const swapped = result_of(scene, {}, GrayKind::none, FrameFault{15, 16, true, sides});
    EXPECT_TRUE(is_warned(swapped, "left: frame 15 is out of order"));
    expect_nothing_wrong(swapped, scene, 0.6);
    EXPECT_EQ(is_warned(doubled, "right: frame 16"), sides.size() == 2);
    EXPECT_EQ(is_warned(swapped, "right: frame 15"), sides.size() == 2);
  }
}

// Bits that a fault flips make other words, which a decoder cannot know: the capture is named unsound. Most pixels go.
TEST(Acquire, ADoubledOrSwappedPictureOfAGrayCodeIsNamed) {
  LightScene const scene;
  for (auto const& sides : kOneSideOrBoth) {
    AcquireResult const doubled = result_of(scene, {}, GrayKind::inverses, FrameFault{4, 5, false, sides});
    EXPECT_TRUE(is_warned(doubled, "left: pictures 4 and 5 (bit 2) are equal instead of a pattern and its inverse"));
    AcquireResult const swapped = result_of(scene, {}, GrayKind::inverses, FrameFault{4, 6, true, sides});
    EXPECT_TRUE(is_warned(swapped, "left: pictures 4 and 5 (bit 2) are no pattern and its inverse"));
    EXPECT_TRUE(is_warned(swapped, "left: pictures 6 and 7 (bit 3) are no pattern and its inverse"));
    std::size_t const sound = result_of(scene, {}, GrayKind::inverses).views.front().depths;
    EXPECT_LT(doubled.views.front().depths, sound / 2);
    EXPECT_LT(swapped.views.front().depths, 2 * sound / 3);
  }
}

// Exchanged in both cameras alike, a pattern and its inverse give other numbers to the same columns: depth is the same.
TEST(Acquire, APatternExchangedWithItsInverseInBothCamerasChangesNoDepth) {
  LightScene const scene;
  AcquireResult const result =
      result_of(scene, {}, GrayKind::inverses, FrameFault{4, 5, true, {Side::left, Side::right}});
  expect_nothing_wrong(result, scene, 0.95);
}

TEST(Acquire, APictureOfAnotherSizeIsNamed) {
  for (auto const gray : {GrayKind::none, GrayKind::levels})
    for (Side const side : kSides) {
      auto const shrink = [&](Capture const& capture) {
        write_file(frame(capture, side, 3), encode_png(cv::Mat1b(36, 48, std::uint8_t{9})));
      };
      EXPECT_SCANVIEW_ERROR(result_of({}, {}, gray, shrink), ErrorCode::bad_input,
                            std::string(to_string(side)) + "/03.png: is 48×36, but the camera was calibrated at 96×72");
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
