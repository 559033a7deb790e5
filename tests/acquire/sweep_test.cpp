#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <opencv2/core.hpp>

#include "acquire/decode_sweep.h"
#include "acquire/peak_fit.h"
#include "base/random.h"
#include "tests/acquire/light_scene.h"

namespace scanview {
namespace {

PeakSamples peak_samples(double time, double width, PixelNoise const& noise, CounterRandom& random) {
  PeakSamples s;
  s.count = 11;
  for (int i = 0; i < s.count; ++i) {
    double const u = (i - time) / width, value = 20 + 150 * std::exp(-0.5 * u * u);
    s.value[i] = static_cast<float>(value + std::sqrt(noise.variance(value)) * random.normal());
    s.usable[i] = true;
  }
  return s;
}

// Cramér and Rao: no unbiased estimate of the four parameters has a smaller covariance than the inverse of the
// information matrix J = sum over i of g g' / v, with g the model's gradient and v the variance of sample i; a normal
// distribution's dependence of v on the parameters adds g g' (v' / v)² / 2, here less than 1 % and not used by the fit.
// RMS of N errors in units of their deviation is 1 within 3 / sqrt(2 N), the mean 0 within 4 / sqrt(N).
TEST(PeakFit, IsUnbiasedAndAtTheInformationBound) {
  constexpr int kCount = 4000;
  PixelNoise const noise{1.5, 0.02};
  for (double const width : {0.8, 1.0, 1.5}) {
    double sum = 0, squares = 0, chi = 0;
    for (int i = 0; i < kCount; ++i) {
      CounterRandom random(11, static_cast<std::uint64_t>(i));
      double const time = 4.5 + random.uniform();
      Peak const peak =
          fit_peak(peak_samples(time, width, noise, random), time < 5 ? 5 : std::round(time), noise, {width, 1e3});
      ASSERT_TRUE(peak.converged) << "seed 11, item " << i;
      double const u = (peak.time - time) / peak.time_sigma;
      sum += u, squares += u * u, chi += peak.chi_square / peak.degrees_of_freedom;
    }
    EXPECT_NEAR(sum / kCount, 0, 4 / std::sqrt(kCount)) << width;
    // Linearisation adds its share, a per cent or two at this signal to noise.
    EXPECT_NEAR(std::sqrt(squares / kCount), 1, 3 / std::sqrt(2.0 * kCount) + 0.02) << width;
    // Chi square a degree of freedom (7): mean 1, standard deviation sqrt(2 / 7 / N).
    EXPECT_NEAR(chi / kCount, 1, 4 * std::sqrt(2.0 / 7 / kCount) + 0.02) << width;
  }
}

TEST(PeakFit, WithoutNoiseItIsExact) {
  for (double time = 4.5; time <= 5.5; time += 0.125) {
    CounterRandom random(1, 1);
    Peak const peak = fit_peak(peak_samples(time, 1.1, {0, 0}, random), 5, {0.5, 0}, {1, 1e3});
    // The fit stops at steps of 1e-3, where Gauss and Newton's error is its square; values are of single precision.
    EXPECT_NEAR(peak.time, time, 1e-4);
    EXPECT_NEAR(peak.width, 1.1, 1e-3);
    EXPECT_NEAR(peak.height, 150, 0.2);
    EXPECT_NEAR(peak.ambient, 20, 0.1);
  }
}

// 32 bins of 8 levels, each bin's variance known to sqrt(2 / n) with n = 2000: the line's ends to a few per cent.
TEST(PixelNoise, IsRecoveredFromResidualsWithOutliers) {
  PixelNoise const truth{2, 0.03};
  for (double const full : {255.0, 65535.0}) {
    double const scale = full / 255;
    NoiseFit fit(full);
    CounterRandom random(3, 1);
    for (int i = 0; i < 64000; ++i) {
      double const level = 250 * random.uniform();
      double const residual = std::sqrt(truth.variance(level)) * random.normal();
      fit.add(level * scale, scale * (i % 100 == 0 ? 60 : residual));
    }
    PixelNoise const noise = fit.solve();
    EXPECT_NEAR(noise.read / (scale * scale), truth.read, 0.15 * truth.read);
    EXPECT_NEAR(noise.gain / scale, truth.gain, 0.08 * truth.gain);
  }
  EXPECT_EQ(NoiseFit(255).solve().read, PixelNoise{}.read);
}

/// Frames of one pixel after the other: brightness(k) + noise, 8 bits; each row has its own beam.
struct Decoded {
  CodeImage image;
  SweepFigures figures;
};
Decoded decode(cv::Size size, int steps, std::function<double(int, int, int)> const& brightness, double read = 1) {
  SpaceTimeDecoder decoder;
  for (int k = 0; k < steps; ++k) {
    cv::Mat1b frame(size);
    CounterRandom random(7, static_cast<std::uint64_t>(k));
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x)
        frame(y, x) = cv::saturate_cast<std::uint8_t>(brightness(x, y, k) + read * random.normal());
    decoder.add(frame);
  }
  Context context;
  CodeImage image = decoder.finish(context);
  return {image, decoder.figures()};
}

double gauss(double u) { return std::exp(-0.5 * u * u); }
std::size_t count_of(CodeImage const& image, PixelClass what) {
  return static_cast<std::size_t>(cv::countNonZero(image.classes == static_cast<int>(what)));
}

TEST(SpaceTimeDecoder, FindsNoiseBeamAndCodes) {
  auto const time = [](int x, int y) { return 4 + 0.25 * x + 0.01 * y; };
  auto const decoded =
      decode({96, 40}, 32, [&](int x, int y, int k) { return 15 + 170 * gauss((k - time(x, y)) / 1.2); });
  EXPECT_NEAR(decoded.figures.beam_sigma, 1.2, 0.02);
  EXPECT_NEAR(decoded.figures.noise.read, 1 + 1.0 / 12, 0.2);
  double squares = 0;
  int wrong = 0, count = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 96; ++x) {
      if (!decoded.image.has_code(x, y)) continue;
      double const u =
          (static_cast<double>(decoded.image.code(y, x)) - time(x, y)) / static_cast<double>(decoded.image.sigma(y, x));
      squares += u * u, wrong += std::abs(u) > 5, ++count;
    }
  EXPECT_EQ(count, 96 * 40);
  EXPECT_EQ(wrong, 0);
  // sqrt(2 N) of a normal distribution is 1 %; the noise itself is known to a few per cent.
  EXPECT_NEAR(std::sqrt(squares / count), 1, 0.06);
}

TEST(SpaceTimeDecoder, VeryDarkSurfacesHaveNoLightAndBrightOnesAreSaturated) {
  auto const decoded = decode({96, 30}, 32, [](int x, int y, int k) {
    double const light = gauss((k - 4 - 0.25 * x) / 1.2);
    return y < 10 ? 15 + 2 * light : y < 20 ? 15 + 20'000 * light : 15 + 170 * light;  // dark, much too bright, right
  });
  // Two levels of light in noise of one: mostly nothing, sometimes a range that looks lit. What is claimed must be
  // true.
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 96; ++x) {
      if (y >= 10) {
        PixelClass const expected = y < 20 ? PixelClass::saturated : PixelClass::object;
        EXPECT_EQ(decoded.image.classes(y, x), static_cast<int>(expected));
      } else if (decoded.image.has_code(x, y)) {
        EXPECT_NEAR(decoded.image.code(y, x), 4 + 0.25 * x,
                    5 * std::hypot(decoded.image.sigma(y, x), decoded.image.bias(y, x)));
      }
    }
  EXPECT_GT(count_of(decoded.image, PixelClass::no_light), 480U);
}

/// A little too bright: the flanks tell where the peak is, and sigma says how well.
TEST(SpaceTimeDecoder, ClippedPeaksAreFittedByTheirFlanksOrSaturated) {
  auto const decoded =
      decode({96, 30}, 32, [](int x, int, int k) { return 15 + 320 * gauss((k - 4 - 0.25 * x) / 1.5); });
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 96; ++x) {
      if (!decoded.image.has_code(x, y)) {
        EXPECT_EQ(decoded.image.classes(y, x), static_cast<int>(PixelClass::saturated));
        continue;
      }
      EXPECT_NEAR(decoded.image.code(y, x), 4 + 0.25 * x,
                  5 * std::hypot(decoded.image.sigma(y, x), decoded.image.bias(y, x)));
    }
}

TEST(SpaceTimeDecoder, AGlossyDoublePeakIsSeveralPeaks) {
  auto const decoded = decode({96, 20}, 32, [](int x, int y, int k) {
    double const t = 4 + 0.15 * x;
    double const second = y < 10 ? 0.85 * gauss((k - t - 9) / 1.2) : 0;
    return 15 + 170 * (gauss((k - t) / 1.2) + second);
  });
  for (int y = 0; y < 20; ++y)
    for (int x = 0; x < 96; ++x)
      EXPECT_EQ(decoded.image.classes(y, x), static_cast<int>(y < 10 ? PixelClass::several_peaks : PixelClass::object));
}

/// Two peaks so near that they are one broad one with a dip.
TEST(SpaceTimeDecoder, PeaksThatOverlapAreNotTakenForOne) {
  auto const decoded = decode({96, 40}, 32, [](int x, int y, int k) {
    double const t = 4 + 0.2 * x;
    double const second = y < 10 ? 0.8 * gauss((k - t - 4) / 1.2) : 0;
    return 15 + 130 * (gauss((k - t) / 1.2) + second);
  });
  int wrong = 0;
  for (int y = 0; y < 10; ++y)
    for (int x = 0; x < 96; ++x)
      wrong += decoded.image.has_code(x, y) && std::abs(decoded.image.code(y, x) - (4 + 0.2 * x)) >
                                                   5 * std::hypot(decoded.image.sigma(y, x), decoded.image.bias(y, x));
  EXPECT_EQ(wrong, 0);
}

/// Four parameters cannot be told from a peak of one frame. A code may be given where its sigma says so.
TEST(SpaceTimeDecoder, ABeamNarrowerThanTheStepClaimsNoMoreThanItKnows) {
  for (double const beam : {0.2, 0.35, 0.5}) {
    auto const time = [](int x) { return 4 + 0.237 * x; };
    auto const decoded =
        decode({96, 40}, 32, [&](int x, int, int k) { return 15 + 170 * gauss((k - time(x)) / beam); });
    int wrong = 0, count = 0;
    for (int y = 0; y < 40; ++y)
      for (int x = 0; x < 96; ++x) {
        if (!decoded.image.has_code(x, y)) continue;
        ++count;
        wrong += std::abs(decoded.image.code(y, x) - time(x)) >
                 5 * std::hypot(decoded.image.sigma(y, x), decoded.image.bias(y, x));
      }
    EXPECT_LE(wrong, 0.005 * count) << "beam " << beam << ", codes " << count;
  }
}

TEST(SpaceTimeDecoder, FramesThatWereLostShiftTheCodesAfterThem) {
  // What a decoder cannot know: codes name the frame, in both cameras alike, and soundness.h names the gap.
  auto const decoded =
      decode({96, 20}, 30, [](int x, int, int k) { return 15 + 170 * gauss((k + (k >= 15) - 2 - 0.25 * x) / 1.2); });
  for (int x = 0; x < 96; ++x) {
    double const time = 2 + 0.25 * x;
    if (time < 11 || time > 19) {
      ASSERT_TRUE(decoded.image.has_code(x, 9)) << x;
      EXPECT_NEAR(decoded.image.code(9, x), time - (time > 15), 0.1) << x;
    }
  }
}

TEST(SpaceTimeDecoder, NothingInNothingOut) {
  Context context;
  EXPECT_TRUE(SpaceTimeDecoder().finish(context).code.empty());
  auto const dark = decode(
      {20, 10}, 12, [](int, int, int) { return 0; }, 0);
  EXPECT_EQ(count_of(dark.image, PixelClass::no_light), 200U);
}

TEST(SpaceTimeDecoder, NoiseAloneIsNoLight) {
  // Of 12 values with a deviation of 1 level the range is below 6 levels in all but 0.1 % of pixels.
  auto const dark = decode(
      {20, 10}, 12, [](int, int, int) { return 10; }, 1);
  EXPECT_GE(count_of(dark.image, PixelClass::no_light), 198U);
}

TEST(StripeDecoder, MiddlesOfStripesNameTheFrame) {
  StripeDecoder decoder;
  for (int k = 0; k < 32; ++k) {
    cv::Mat1b frame(20, 96);
    for (int y = 0; y < 20; ++y)
      for (int x = 0; x < 96; ++x)
        frame(y, x) = cv::saturate_cast<std::uint8_t>(15 + 170 * gauss((x - 3.0 * k - 1) / 2.4));
    decoder.add(frame);
  }
  CodeImage const image = decoder.finish();
  // A centroid of whole levels above half the height: off by a few hundredths of a pixel, a third of that in code.
  for (int y = 0; y < 20; ++y)
    for (int x = 10; x < 86; ++x) EXPECT_NEAR(image.code(y, x), (x - 1) / 3.0, 0.05) << x;
  EXPECT_NE(decoder.centres()(5, 31), 0);
}

}  // namespace
}  // namespace scanview
