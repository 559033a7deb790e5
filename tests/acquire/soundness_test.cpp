#include "acquire/soundness.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "acquire/rig_shift.h"
#include "base/random.h"
#include "tests/expect_error.h"

namespace scanview {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::SizeIs;

constexpr int kWidth = 240, kHeight = 80, kFrames = 48;

/// Bright and dark paint with edges.
double paint(double x, double y) {
  bool const is_dark = (static_cast<int>(x) / 37 + static_cast<int>(y) / 23) % 3 == 0;
  return (0.55 + 0.35 * std::sin(0.21 * x) * std::cos(0.13 * y)) * (is_dark ? 0.4 : 1);
}

/// When the light passes a pixel, in frames: a curved surface, and a box in front of it.
double passing(int x, int y) {
  double const box = x > 90 && x < 150 && y > 20 && y < 60 ? 5 : 0;
  return 0.2 * x + 2 * std::sin(0.02 * y) + box;
}

struct SweepFaults {
  std::vector<double> times;  ///< where the light is in each frame; empty: 0, 1, 2 ...
  std::function<double(int)> gain = [](int) { return 1.0; };
  double exposure = 200;  ///< the largest value
  double beam = 0.8, noise = 1, gamma = 1;
  std::uint64_t seed = 1;
};

cv::Mat1b sweep_frame(SweepFaults const& faults, int k) {
  cv::Mat1b frame(kHeight, kWidth);
  double const time = faults.times.empty() ? k : faults.times[static_cast<std::size_t>(k)];
  CounterRandom random(faults.seed, static_cast<std::uint64_t>(k));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      double const beam = std::exp(-0.5 * std::pow((time - passing(x, y)) / faults.beam, 2));
      double const light = paint(x, y) * (0.05 + 0.9 * faults.gain(k) * beam);
      double const value = faults.exposure * std::pow(light, 1 / faults.gamma) + faults.noise * random.normal();
      frame(y, x) = cv::saturate_cast<std::uint8_t>(value);
    }
  return frame;
}

SoundnessFigures sweep(SweepFaults const& faults) {
  SweepSoundness soundness("left");
  for (int k = 0; k < kFrames; ++k) soundness.add(sweep_frame(faults, k));
  return soundness.finish();
}

std::vector<double> times() {
  std::vector<double> result;
  for (int k = 0; k < kFrames; ++k) result.push_back(k);
  return result;
}

TEST(SweepSoundness, ACleanSweepRaisesNoAlarm) {
  std::uint64_t seed = 1;
  for (double const noise : {0.0, 1.0, 1.0, 2.5}) {
    SweepFaults faults;
    faults.seed = seed++;
    faults.noise = noise;
    auto const figures = sweep(faults);
    EXPECT_THAT(figures.warnings, IsEmpty()) << figures.to_json().dump();
    // The ambient light's estimate is off by a fraction of the noise: a few per cent of a value at twelve deviations.
    EXPECT_NEAR(figures.beam_steps, 0.8, 0.06);
    EXPECT_NEAR(255 * figures.noise, std::hypot(noise, 0.29), 0.25 * noise + 0.1);
    EXPECT_EQ(figures.frames, static_cast<std::size_t>(kFrames));
  }
}

TEST(SweepSoundness, AMissingFrameIsNamed) {
  for (std::size_t const missing : {12U, 20U, 31U}) {
    SweepFaults faults;
    faults.times = times();
    for (std::size_t i = missing; i < faults.times.size(); ++i) faults.times[i] += 1;
    auto const figures = sweep(faults);
    EXPECT_THAT(figures.missing, ElementsAre(missing));
    EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("missing before frame " + std::to_string(missing))));
  }
}

TEST(SweepSoundness, ADoubledFrameIsNamed) {
  // Taken twice: another noise, the same light.
  SweepFaults faults;
  faults.times = times();
  for (std::size_t i = 21; i < faults.times.size(); ++i) faults.times[i] -= 1;
  auto const figures = sweep(faults);
  EXPECT_THAT(figures.doubled, ElementsAre(21U));
  EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("frame 21 shows the same light")));
  // The same file twice.
  SweepSoundness copied("right");
  for (int k = 0; k < kFrames; ++k) copied.add(sweep_frame({}, k == 21 ? 20 : k));
  EXPECT_THAT(copied.finish().doubled, ElementsAre(21U));
}

TEST(SweepSoundness, FramesOutOfOrderAreNamed) {
  SweepFaults faults;
  faults.times = times();
  std::swap(faults.times[25], faults.times[26]);
  auto const swapped = sweep(faults);
  EXPECT_THAT(swapped.out_of_order, ElementsAre(25U));
  EXPECT_THAT(swapped.missing, IsEmpty());
  EXPECT_THAT(swapped.doubled, IsEmpty());
  // One frame far away from its place.
  faults.times = times();
  faults.times.insert(faults.times.begin() + 30, faults.times[10]);
  faults.times.erase(faults.times.begin() + 10);
  auto const moved = sweep(faults);
  EXPECT_THAT(moved.out_of_order, ElementsAre(29U));
  EXPECT_THAT(moved.missing, ElementsAre(10U));
}

TEST(SweepSoundness, FlickerIsMeasured) {
  SweepFaults faults;
  faults.gain = [](int k) { return 1 + 0.08 * CounterRandom(77, static_cast<std::uint64_t>(k)).normal(); };
  auto const figures = sweep(faults);
  // A robust scatter of some forty values that share gains: to about a quarter.
  EXPECT_NEAR(figures.flicker, 0.08, 0.03);
  EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("brightness varies")));
}

TEST(SweepSoundness, ALaggingLightIsToldFromMissingFrames) {
  SweepFaults faults;
  faults.times = times();
  for (std::size_t i = 0; i < faults.times.size(); ++i) faults.times[i] += 0.3 * CounterRandom(5, i).normal();
  auto const figures = sweep(faults);
  EXPECT_GT(figures.step_scatter, 0.25);
  EXPECT_THAT(figures.missing, IsEmpty());
  EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("steps vary")));
}

// Both cameras see the same light: what one of them alone makes of it comes from its part of the scene.
TEST(SweepSoundness, StepsAreUnevenWhereBothCamerasSaySo) {
  SweepFaults faults;
  faults.times = times();
  for (std::size_t i = 0; i < faults.times.size(); ++i) faults.times[i] += 0.3 * CounterRandom(5, i).normal();
  auto left = sweep(faults), right = left, even = sweep({});
  reconcile(left, right);
  EXPECT_THAT(left.warnings, ElementsAre(HasSubstr("steps vary")));
  EXPECT_EQ(left.warnings, right.warnings);
  reconcile(even, right);
  EXPECT_THAT(even.warnings, IsEmpty());
  EXPECT_THAT(right.warnings, IsEmpty());
}

TEST(SweepSoundness, OverexposureAndANarrowBeamAreWarnedOf) {
  SweepFaults bright;
  bright.exposure = 500;
  EXPECT_THAT(sweep(bright).warnings, ElementsAre(HasSubstr("at full scale")));
  SweepFaults narrow;
  narrow.beam = 0.2;
  auto const figures = sweep(narrow);
  EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("narrower than half its step")));
}

TEST(SweepSoundness, SixteenBitsGiveTheSameFigures) {
  SweepSoundness narrow("left"), wide("left");
  for (int k = 0; k < kFrames; ++k) {
    cv::Mat1b const frame = sweep_frame({}, k);
    cv::Mat1w copy;
    frame.convertTo(copy, CV_16U, 257);
    narrow.add(frame);
    wide.add(copy);
  }
  auto const a = narrow.finish(), b = wide.finish();
  EXPECT_NEAR(a.beam_steps, b.beam_steps, 1e-3);
  EXPECT_THAT(b.warnings, IsEmpty());
  SweepSoundness soundness("left");
  soundness.add(cv::Mat1b::zeros(10, 10));
  EXPECT_SCANVIEW_ERROR(soundness.add(cv::Mat1b::zeros(10, 11)), ErrorCode::bad_input, "11x10");
  EXPECT_SCANVIEW_ERROR(soundness.add(cv::Mat3b::zeros(10, 10)), ErrorCode::bad_input, "gray");
}

TEST(SweepSoundness, DarkOrFewFramesAreNoCrash) {
  EXPECT_EQ(SweepSoundness("left").finish().frames, 0U);
  SweepSoundness dark("left");
  for (int k = 0; k < 10; ++k) dark.add(cv::Mat1b::zeros(20, 30));
  EXPECT_THAT(dark.finish().warnings, ElementsAre(HasSubstr("hardly visible")));
}

constexpr int kBits = 7;  // 128 columns over the picture: stripes of the finest are four pixels wide

struct GrayFaults {
  std::function<double(double, double)> paint = scanview::paint;
  double blur = 1.0, noise = 1, gamma = 1, exposure = 200;
  std::function<double(int)> gain = [](int) { return 1.0; };
  cv::Point2d moved;  ///< white and black were taken with the scene so many pixels beside its place
  std::uint64_t seed = 1;
};

/// What the projector shows: -1 white, -2 black, else the pattern picture of this number.
cv::Mat1b gray_picture(GrayFaults const& faults, int number) {
  cv::Mat1f light(kHeight, kWidth);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      int const column = static_cast<int>(passing(x, y) * 128 / 56);
      int const code = column ^ (column >> 1);
      int const bit = (code >> (kBits - 1 - number / 2)) & 1;
      light(y, x) = number == -1 ? 1.0F : number == -2 ? 0.0F : static_cast<float>(bit ^ (number % 2));
    }
  cv::GaussianBlur(light, light, {}, faults.blur);
  cv::Mat1b picture(kHeight, kWidth);
  CounterRandom random(faults.seed, static_cast<std::uint64_t>(number + 10));
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      cv::Point2d const at = cv::Point2d(x, y) - (number < 0 ? faults.moved : cv::Point2d());
      double const seen =
          faults.paint(at.x, at.y) * (0.05 + 0.9 * faults.gain(number) * static_cast<double>(light(y, x)));
      picture(y, x) = cv::saturate_cast<std::uint8_t>(faults.exposure * std::pow(seen, 1 / faults.gamma) +
                                                      faults.noise * random.normal());
    }
  return picture;
}

SoundnessFigures gray(GrayFaults const& faults, std::vector<int> order = {}) {
  if (order.empty())
    for (int k = 0; k < 2 * kBits; ++k) order.push_back(k);
  GraySoundness soundness("left", {kBits, 0, true});
  soundness.set_white(gray_picture(faults, -1));
  soundness.set_black(gray_picture(faults, -2));
  for (int const k : order) soundness.add(gray_picture(faults, k));
  return soundness.finish();
}

TEST(GraySoundness, ACleanCaptureRaisesNoAlarm) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed)
    for (double const noise : {0.0, 1.0, 2.5}) {
      GrayFaults faults;
      faults.seed = seed;
      faults.noise = noise;
      auto const figures = gray(faults);
      EXPECT_THAT(figures.warnings, IsEmpty()) << figures.to_json().dump();
      EXPECT_NEAR(figures.gamma, 1, 0.1);
      EXPECT_LT(figures.flicker, 0.01);
    }
}

TEST(GraySoundness, ACurvedResponseIsMeasured) {
  GrayFaults faults;
  faults.gamma = 2.2;
  auto const figures = gray(faults);
  EXPECT_NEAR(figures.gamma, 2.2, 0.25);
  EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("gamma about 2.")));
}

TEST(GraySoundness, AMissingPictureIsNamed) {
  auto const figures = gray({}, {0, 1, 2, 3, 5, 6, 7, 8, 9, 10, 11, 12, 13});
  EXPECT_THAT(figures.out_of_order, testing::Contains(4U));
  EXPECT_THAT(figures.warnings, testing::Contains(HasSubstr("13 pattern pictures where 14")));
  EXPECT_THAT(figures.warnings, testing::Contains(HasSubstr("pictures 4 and 5 (bit 2) are no pattern")));
}

TEST(GraySoundness, ADoubledPictureIsNamed) {
  auto const figures = gray({}, {0, 1, 2, 3, 4, 4, 6, 7, 8, 9, 10, 11, 12, 13});
  EXPECT_THAT(figures.doubled, ElementsAre(5U));
  EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("are equal")));
}

TEST(GraySoundness, BitsOutOfOrderAreNamed) {
  auto const swapped = gray({}, {0, 1, 2, 3, 6, 7, 4, 5, 8, 9, 10, 11, 12, 13});
  EXPECT_THAT(swapped.out_of_order, testing::Contains(6U));
  auto const doubled = gray({}, {0, 1, 2, 3, 4, 5, 6, 7, 6, 7, 10, 11, 12, 13});
  EXPECT_THAT(doubled.doubled, ElementsAre(8U));
}

TEST(GraySoundness, FlickerAndOverexposureAreMeasured) {
  GrayFaults faults;
  faults.gain = [](int k) { return k < 0 ? 1 : 1 + 0.08 * CounterRandom(3, static_cast<std::uint64_t>(k)).normal(); };
  auto const figures = gray(faults);
  EXPECT_NEAR(figures.flicker, 0.08, 0.045);  // an RMS of six or seven differences
  EXPECT_THAT(figures.warnings, ElementsAre(HasSubstr("brightness varies")));
  GrayFaults bright;
  bright.exposure = 500;
  EXPECT_THAT(gray(bright).warnings, testing::Contains(HasSubstr("at full scale")));
}

/// Paint with slopes everywhere, as a cloth has them.
double cloth(double x, double y) {
  return 0.6 + 0.2 * std::sin(0.45 * x + 0.2 * y) + 0.19 * std::sin(0.5 * y - 0.11 * x);
}

TEST(GraySoundness, ASceneThatMovedAfterTheFirstPicturesIsMeasured) {
  struct Case {
    cv::Point2d moved;
    double gamma, exposure;
  };
  // At an exposure of 400 a third of the paint is at full scale.
  for (auto const& [moved, gamma, exposure] : {Case{{1, 0}, 1, 200},
                                               {{0, -1}, 1, 200},
                                               {{0, 1.3}, 1, 200},
                                               {{-0.6, 0}, 1, 200},
                                               {{1, 0}, 2.2, 200},
                                               {{0, -1}, 1, 400}})
    for (std::uint64_t seed = 1; seed <= 3; ++seed) {
      GrayFaults faults;
      faults.paint = cloth;
      faults.moved = moved;
      faults.gamma = gamma;
      faults.exposure = exposure;
      faults.seed = seed;
      auto const figures = gray(faults);
      // Paint has up to ω = 0.5 a pixel along a line: the central difference is ω² / 6 too small, the mean of two
      // slopes (ω size)² / 12. Noise: the largest of a dozen figures.
      double const size = std::hypot(moved.x, moved.y);
      double const excess = 0.25 / 6 + 0.25 * size * size / 12;
      EXPECT_NEAR(figures.motion_px, size, excess * size + 4 * figures.motion_std_px) << figures.to_json().dump();
      EXPECT_LT(figures.motion_std_px, 0.1);
      EXPECT_TRUE(figures.moved());
      EXPECT_THAT(figures.warnings, testing::Contains(HasSubstr("beside its place")));
    }
}

TEST(GraySoundness, GammaFlickerNoiseAndPaintAreNoMotion) {
  std::uint64_t seed = 0;
  for (double const gamma : {0.7, 1.0, 2.2})
    for (double const flicker : {0.0, 0.08})
      for (bool const is_cloth : {false, true}) {
        GrayFaults faults;
        if (is_cloth) faults.paint = cloth;
        faults.seed = ++seed;
        faults.gamma = gamma;
        faults.noise = seed % 3 == 0 ? 0 : 2.5;
        faults.exposure = seed % 2 == 0 ? 200 : 400;
        faults.gain = [&](int k) {
          return 1 + flicker * CounterRandom(seed, static_cast<std::uint64_t>(k + 3)).normal();
        };
        auto const figures = gray(faults);
        EXPECT_FALSE(figures.moved()) << "seed " << seed << ": " << figures.to_json().dump();
      }
}

/// A picture with detail, at any place.
double texture(double x, double y) {
  return 120 + 40 * std::sin(0.61 * x + 0.3 * y) + 35 * std::sin(0.17 * x - 0.52 * y) +
         25 * std::cos(0.43 * y + 0.09 * x);
}

/// A rectified picture that is the camera's own.
PictureMap own_pixels(int width, int height) {
  Camera const camera = Camera::perspective(width, height, 300, 300, width / 2.0, height / 2.0);
  return {camera, Eigen::Matrix3d::Identity(), LensCamera{camera, {}}};
}

RigShift shifted(std::function<double(int, int)> const& dy, double noise, std::uint64_t seed) {
  cv::Mat1b left(240, 320), right(240, 320);
  cv::Mat1f x_right(240, 320, std::numeric_limits<float>::quiet_NaN());
  CounterRandom random(seed, 2);
  for (int y = 0; y < 240; ++y)
    for (int x = 0; x < 320; ++x) {
      // The surface is sheared: disparity 12 + 0.05 y. Another exposure in the right camera.
      double const disparity = 12 + 0.05 * y;
      left(y, x) = cv::saturate_cast<std::uint8_t>(texture(x, y) + noise * random.normal());
      double const row = y - dy(x, y);
      right(y, x) =
          cv::saturate_cast<std::uint8_t>(0.8 * texture(x + 12 + 0.05 * row, row) + 20 + noise * random.normal());
      if (x > disparity && (x / 40 + y / 40) % 5 != 0) x_right(y, x) = static_cast<float>(x - disparity);
    }
  Context context;
  PictureMap const map = own_pixels(320, 240);
  return measure_rig_shift(
      {left, map}, {right, map}, [&](int x, int y) { return x_right(y, x); }, context);
}

TEST(RigShift, AStillRigRaisesNoAlarm) {
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    auto const shift = shifted([](int, int) { return 0.0; }, 2, seed);
    ASSERT_GT(shift.points, 100U);
    // Interpolating 8-bit values and the derivative's truncation (h² f''' / 6 with detail of 0.5 a pixel: 4 %) leave
    // less than a twentieth of a pixel.
    EXPECT_LT(std::abs(shift.median_px), 0.05);
    EXPECT_LT(shift.rms_px, 0.1);
    EXPECT_TRUE(shift.warning.empty()) << shift.warning;
  }
}

TEST(RigShift, PitchIsMeasured) {
  for (double const dy : {-1.3, 0.6, 2.4}) {
    auto const shift = shifted([dy](int, int) { return dy; }, 2, 4);
    EXPECT_NEAR(shift.median_px, dy, 0.08);
    EXPECT_NEAR(shift.offset_px, dy, 0.08);
    EXPECT_THAT(shift.warning, HasSubstr("up or down"));
  }
}

TEST(RigShift, RollIsMeasured) {
  auto const shift = shifted([](int x, int) { return 3.0 * (x - 160) / 320; }, 2, 5);
  // The right picture's column differs from the left one's by the disparity, here by about 18 pixels of 320.
  EXPECT_NEAR(shift.tilt_px, 3, 0.2);
  EXPECT_NEAR(shift.offset_px, -3 * 18.0 / 320, 0.1);
  EXPECT_THAT(shift.warning, HasSubstr("viewing axis"));
}

TEST(RigShift, MotionBetweenThePicturesIsNotBlamedOnTheRig) {
  auto const pitch = shifted([](int, int) { return 0.8; }, 2, 4);
  SoundnessFigures still, moved;
  still.motion_px = moved.motion_px = 1.1;
  still.motion_std_px = 0.5;
  moved.motion_std_px = 0.05;
  RigShift explained = pitch, calibration = pitch, both = shifted([](int, int) { return 2.4; }, 2, 4);
  reconcile(explained, moved, still);
  EXPECT_THAT(explained.warning, HasSubstr("take the view again"));
  EXPECT_THAT(explained.warning, Not(HasSubstr("calibrat")));
  EXPECT_EQ(explained.rms_px, pitch.rms_px);
  reconcile(calibration, still, still);
  EXPECT_EQ(calibration.warning, pitch.warning);
  reconcile(both, moved, still);  // more than the motion can explain
  EXPECT_THAT(both.warning, HasSubstr("calibrate again"));
  RigShift silent = shifted([](int, int) { return 0.0; }, 2, 4);
  reconcile(silent, moved, moved);
  EXPECT_THAT(silent.warning, IsEmpty());
}

TEST(RigShift, WithoutTextureOrMatchesNothingIsClaimed) {
  Context context;
  cv::Mat1b const flat(100, 100, std::uint8_t{128});
  PictureMap const map = own_pixels(100, 100), lower = own_pixels(100, 90);
  auto const column = [](int, int) { return 50.0F; };
  auto const shift = measure_rig_shift({flat, map}, {flat, map}, column, context);
  EXPECT_EQ(shift.points, 0U);
  EXPECT_TRUE(std::isnan(shift.median_px));
  EXPECT_TRUE(shift.warning.empty());
  EXPECT_SCANVIEW_ERROR(measure_rig_shift({flat, map}, {flat, lower}, column, context), ErrorCode::bad_input, "rows");
}

}  // namespace
}  // namespace scanview
