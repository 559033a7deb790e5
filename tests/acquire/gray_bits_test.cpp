#include "acquire/gray_bits.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <opencv2/imgproc.hpp>

#include "acquire/decode_gray.h"
#include "base/random.h"
#include "tests/acquire/light_scene.h"

namespace scanview {
namespace {

using Column = std::function<double(int, int)>;  // of the projector, at a pixel
constexpr int kBits = 5;
constexpr float kMiddle = 0.288675F;  // sigma of a column's middle: 1 / sqrt(12)

int gray_word(int column) { return column ^ (column >> 1); }

/// d of one pixel for each bit of a column, `strength` everywhere; the finest first.
std::array<int, kBits> differences(int column, int strength = 100) {
  std::array<int, kBits> d{};
  for (int bit = 0; bit < kBits; ++bit)
    d[static_cast<std::size_t>(bit)] = (gray_word(column) >> bit & 1) != 0 ? strength : -strength;
  return d;
}
GrayBits bits_of(std::array<int, kBits> const& d) {
  GrayBits bits;
  for (int bit = kBits - 1; bit >= 0; --bit) {
    int const value = d[static_cast<std::size_t>(bit)];
    bits.add(bit, cv::Mat1w(1, 1, static_cast<std::uint16_t>(std::max(value, 0))),
             cv::Mat1w(1, 1, static_cast<std::uint16_t>(std::max(-value, 0))));
  }
  return bits;
}
DifferenceNoise even_noise(cv::Size size, float sigma = 1) { return {cv::Mat1w::zeros(size), {sigma}}; }
int whole(std::array<int, kBits> const& d, float noise = 1, std::optional<int> count = {}) {
  return whole_codes(bits_of(d), even_noise({1, 1}, noise), count)(0, 0);
}

/// Bits whose d passes zero linearly over a column's width around each border, as a blurred stripe does.
GrayBits bits_of(cv::Size size, Column const& column, double noise = 0) {
  GrayBits bits;
  for (int bit = kBits - 1; bit >= 0; --bit) {
    cv::Mat1w pattern(size), inverse(size, std::uint16_t{30000});
    CounterRandom random(5, static_cast<std::uint64_t>(bit));
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x)
        pattern(y, x) = cv::saturate_cast<std::uint16_t>(30000 + 4000 * (gray_stripe(column(x, y), bit) - 0.5) +
                                                         noise * random.normal());
    bits.add(bit, pattern, inverse);
  }
  return bits;
}
int count_of(CodeImage const& image, PixelClass what) {
  return cv::countNonZero(image.classes == static_cast<int>(what));
}

TEST(GrayBits, SpellTheColumn) {
  for (int column = 0; column < 1 << kBits; ++column) {
    EXPECT_EQ(whole(differences(column)), column);
    EXPECT_EQ(whole(differences(column, 65535)), column) << "16 bits at their ends";
    EXPECT_EQ(whole(differences(column), 1, 20), column < 20 ? column : -2) << "columns beyond the projector's";
  }
}

// A pattern that equals its inverse says nothing of its bit. Where the bit decides between two neighbouring columns the
// pixel is on the border between them, and either is right; elsewhere the bits contradict the light's shape.
TEST(GrayBits, ATieIsABorderBetweenNeighboursOrAContradiction) {
  int borders = 0;
  for (int column = 0; column < 1 << kBits; ++column)
    for (std::size_t bit = 0; bit < kBits; ++bit) {
      auto d = differences(column);
      d[bit] = 0;
      int const code = whole(d);
      auto other = differences(column);
      other[bit] = -other[bit];
      int const partner = whole(other);
      if (std::abs(partner - column) == 1) {
        EXPECT_TRUE(code == column || code == partner) << column << ", bit " << bit;
        ++borders;
      } else {
        EXPECT_EQ(code, -2) << column << ", bit " << bit;
      }
    }
  EXPECT_EQ(borders, 2 * ((1 << kBits) - 1)) << "every border from both sides";
}

TEST(GrayBits, TwoTiesThatAreNotTheFinestBitsAreAContradiction) {
  for (int column = 0; column < 1 << kBits; ++column)
    for (std::size_t a = 1; a < kBits; ++a)
      for (std::size_t b = 1; b < a; ++b) {
        auto d = differences(column);
        d[a] = d[b] = 0;
        EXPECT_EQ(whole(d), -2) << column << ", bits " << a << ' ' << b;
      }
}

TEST(GrayBits, DoubtGoesByTheNoise) {
  auto d = differences(9);
  d[3] /= 25;                  // 4 levels, of a bit that decides between columns far from each other
  EXPECT_EQ(whole(d, 1), 9);   // 4 deviations
  EXPECT_EQ(whole(d, 2), -2);  // 2
  // Light is 8 deviations of the largest d, and 4 levels at least.
  EXPECT_EQ(whole(differences(9, 100), 12), 9);
  EXPECT_EQ(whole(differences(9, 100), 13), -1);
  EXPECT_EQ(whole(differences(9, 4), 0.1F), 9);
  EXPECT_EQ(whole(differences(9, 3), 0.1F), -1);
  EXPECT_EQ(whole(differences(9, 0), 0), -1) << "all tie: no light";
}

TEST(BorderCodes, AreLinearBetweenTheBordersThatDPassesZeroAt) {
  auto const column = [](int x, int) { return 0.31 + 0.17 * x; };
  CodeImage const image = border_codes(bits_of({170, 3}, column), even_noise({170, 3}), {});
  for (int y = 0; y < 3; ++y)
    for (int x = 0; x < 170; ++x) {
      ASSERT_TRUE(image.has_code(x, y)) << x;
      // Columns that the picture cuts off have one border only: their middle. d is of whole levels, of 4000 a column:
      // borders to 2e-4 of a column.
      bool const is_cut = column(x, y) < 1 || column(x, y) > std::floor(column(169, y));
      EXPECT_NEAR(image.code(y, x), is_cut ? std::floor(column(x, y)) + 0.5 : column(x, y), 1e-3) << x;
      EXPECT_EQ(image.sigma(y, x) == kMiddle, is_cut) << x;
      EXPECT_EQ(image.bias(y, x), 0);
    }
}

TEST(BorderCodes, ACodeThatChangesDownThePictureIsReadDownThePicture) {
  auto const column = [](int x, int y) { return 1 + 0.2 * x + 0.01 * y; };
  auto const down = [&](int x, int y) { return column(y, x); };
  GrayBits const bits = bits_of({120, 40}, column, 20), turned = bits_of({40, 120}, down, 0);
  CodeImage const image = border_codes(bits_of({120, 40}, column), even_noise({120, 40}), {});
  CodeImage const other = border_codes(turned, even_noise({40, 120}), {});
  cv::Mat1f const code = other.code.t(), sigma = other.sigma.t();
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 120; ++x) {
      EXPECT_EQ(image.code(y, x), code(y, x));
      EXPECT_EQ(image.sigma(y, x), sigma(y, x));
    }
}

// Two borders of a column, each off by the noise of d (20) over its slope there (4000 a column): 1/200 of a column, and
// less between them. RMS of error / sigma over some 4000 pixels, of which a column's six share two borders: 1 within
// 3 sqrt(6 / 8000) = 8 %; sigma comes from scattered second differences where they say more than noise does.
TEST(BorderCodes, SigmaIsThatOfTheBorders) {
  auto const column = [](int x, int y) { return 1 + 0.17 * x + 0.013 * y; };
  CodeImage const image = border_codes(bits_of({160, 40}, column, 20), even_noise({160, 40}, 20.0F), {});
  double squares = 0, count = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 160; ++x) {
      if (!image.has_code(x, y) || image.sigma(y, x) == kMiddle) continue;
      double const u = (static_cast<double>(image.code(y, x)) - column(x, y)) / static_cast<double>(image.sigma(y, x));
      EXPECT_LT(std::abs(u), 6) << x << ' ' << y;
      squares += u * u, ++count;
    }
  EXPECT_GT(count, 4000);
  EXPECT_NEAR(std::sqrt(squares / count), 1, 0.2);
}

TEST(BorderCodes, PicturesOfOnePixelLineOrColumnAreRead) {
  for (cv::Size const size : {cv::Size(1, 1), cv::Size(2, 1), cv::Size(1, 2), cv::Size(40, 1), cv::Size(1, 40)}) {
    auto const column = [](int x, int y) { return 3.2 + 0.3 * (x + y); };
    CodeImage const image = border_codes(bits_of(size, column), even_noise(size), {});
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        ASSERT_TRUE(image.has_code(x, y)) << size;
        EXPECT_LT(std::abs(image.code(y, x) - column(x, y)), 0.5001) << size;
      }
  }
}

/// Gray-code pictures of one camera: white times the stripe, above black.
struct Pictures {
  cv::Size size = {120, 30};
  Column column = [](int x, int y) { return 1.3 + 0.2 * x + 0.02 * y; };
  std::function<double(int, int)> white = [](int, int) { return 200; }, black = [](int, int) { return 20; };
  double blur_px = 0, noise = 0;  ///< standard deviations, of the lens and of a level
  int depth = CV_8U;

  cv::Mat take(GrayFrame const& frame) const {
    cv::Mat1d values(size);
    CounterRandom random(9, static_cast<std::uint64_t>(frame.bit * 8 + frame.inverse * 4 + frame.is_row * 2));
    for (int y = 0; y < size.height; ++y)
      for (int x = 0; x < size.width; ++x) {
        double lit = frame.kind == GrayFrame::Kind::white ? 1 : 0;
        if (frame.kind == GrayFrame::Kind::bit) {
          lit = gray_stripe(frame.is_row ? 1.0 + y / 2 : column(x, y), frame.bit);  // NOLINT: rows are two pixels high
          if (frame.inverse) lit = 1 - lit;
        }
        values(y, x) = black(x, y) + (white(x, y) - black(x, y)) * lit;
      }
    if (blur_px > 0) cv::GaussianBlur(values, values, {}, blur_px);
    for (double& value : values) value += noise * random.normal();
    cv::Mat result;
    values.convertTo(result, depth, depth == CV_16U ? 257 : 1);
    return result;
  }
};

/// The frames' decoded picture, handed over in the order of the list.
CodeImage decoded(Pictures const& pictures, std::vector<GrayFrame> const& frames, Capture const& capture = {}) {
  GrayDecoder decoder(capture);
  for (GrayFrame const& frame : frames) decoder.add(frame, pictures.take(frame));
  return decoder.finish();
}
std::vector<GrayFrame> pairs() {
  std::vector<GrayFrame> frames;
  for (int bit = kBits - 1; bit >= 0; --bit)
    for (bool const inverse : {false, true}) frames.push_back({GrayFrame::Kind::bit, bit, false, inverse});
  return frames;
}
std::vector<GrayFrame> without_inverses() {
  std::vector<GrayFrame> frames = {{GrayFrame::Kind::white}, {GrayFrame::Kind::black}};
  for (int bit = kBits - 1; bit >= 0; --bit) frames.push_back({GrayFrame::Kind::bit, bit, false, false});
  return frames;
}

TEST(GrayDecoder, TheOrderOfThePicturesDoesNotMatter) {
  for (auto frames : {pairs(), without_inverses()}) {
    CodeImage const first = decoded({}, frames);
    EXPECT_EQ(count_of(first, PixelClass::object), 120 * 30);
    std::reverse(frames.begin(), frames.end());
    CodeImage const second = decoded({}, frames);
    EXPECT_EQ(cv::norm(first.code, second.code, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(first.classes, second.classes, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(first.lit, second.lit, cv::NORM_INF), 0);
  }
}

TEST(GrayDecoder, SixteenBitsGiveTheSameCodes) {
  for (auto const& frames : {pairs(), without_inverses()}) {
    Pictures pictures;
    CodeImage const shallow = decoded(pictures, frames);
    pictures.depth = CV_16U;
    CodeImage const deep = decoded(pictures, frames);
    EXPECT_EQ(cv::norm(shallow.classes, deep.classes, cv::NORM_INF), 0);
    EXPECT_LE(cv::norm(shallow.lit, deep.lit, cv::NORM_INF), 1);
    // A border is where d = 0: half a level off each way over a slope of 360 a column and 180 without inverses.
    EXPECT_LT(cv::norm(shallow.code, deep.code, cv::NORM_INF), 1.0 / 180);
  }
}

// What no picture changes: a surface that the light does not reach, one that is black, and one at full scale.
TEST(GrayDecoder, DarkUnlitAndSaturatedSurfacesSaySo) {
  for (int const depth : {CV_8U, CV_16U})
    for (auto const& frames : {pairs(), without_inverses()}) {
      Pictures pictures;
      pictures.depth = depth;
      pictures.noise = 0.7;
      pictures.white = [](int x, int) { return x < 30 ? 90 : x < 60 ? 3 : x < 90 ? 1000 : 180; };
      pictures.black = [](int x, int) { return x < 30 ? 90 : x < 60 ? 2 : x < 90 ? 400 : 20; };
      CodeImage const image = decoded(pictures, frames);
      for (int y = 0; y < 30; ++y)
        for (int x = 0; x < 120; ++x) {
          PixelClass const expected = x < 60   ? PixelClass::no_light
                                      : x < 90 ? PixelClass::saturated
                                               : PixelClass::object;
          EXPECT_EQ(image.classes(y, x), static_cast<int>(expected)) << x << ' ' << y;
        }
    }
}

// Where light that another surface sent back outshines the bit's own, the pattern equals its inverse or is darker.
TEST(GrayDecoder, ACoarseBitThatTiesIsSeveralPeaksAndTheRestStays) {
  Capture const capture;
  GrayDecoder decoder(capture);
  Pictures const pictures;
  for (GrayFrame const& frame : pairs()) {
    cv::Mat picture = pictures.take(frame);
    if (frame.bit == 3) picture.colRange(40, 50).setTo(110);  // columns 9.3 to 11.9: far from 8 and 24
    decoder.add(frame, picture);
  }
  CodeImage const image = decoder.finish();
  EXPECT_EQ(count_of(image, PixelClass::several_peaks), 10 * 30);
  EXPECT_EQ(count_of(image, PixelClass::object), 110 * 30);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 120; ++x) {
      if (!image.has_code(x, y)) continue;
      EXPECT_NEAR(image.code(y, x), pictures.column(x, y), 5 * static_cast<double>(image.sigma(y, x)));
    }
}

TEST(GrayDecoder, ColumnsBeyondTheProjectorsAreNone) {
  Capture capture;
  capture.projector_columns = 20;
  Pictures const pictures;
  CodeImage const image = decoded(pictures, pairs(), capture);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 120; ++x) {
      if (std::abs(pictures.column(x, y) - 20) < 0.1) continue;  // on the border itself
      EXPECT_EQ(image.has_code(x, y), pictures.column(x, y) < 20) << x << ' ' << y;
    }
}

TEST(GrayDecoder, RowsAreWholeAndNegativeWhereUndecided) {
  Capture const capture;
  GrayDecoder decoder(capture);
  EXPECT_TRUE(decoder.rows().empty());
  Pictures pictures;
  pictures.white = [](int x, int) { return x < 10 ? 20 : 200; };
  std::vector<GrayFrame> frames = pairs();
  for (GrayFrame frame : pairs()) frame.is_row = true, frames.push_back(frame);
  for (GrayFrame const& frame : frames) decoder.add(frame, pictures.take(frame));
  CodeImage const image = decoder.finish();
  ASSERT_EQ(decoder.rows().size(), pictures.size);
  for (int y = 0; y < 30; ++y)
    for (int x = 0; x < 120; ++x) {
      if (x < 10) {
        EXPECT_LT(decoder.rows()(y, x), 0);
      } else {  // a row that starts at a whole number is on a border: either side of it
        EXPECT_LE(std::abs(decoder.rows()(y, x) - (1 + y / 2)), 1);
      }
    }
}

// The lens takes the contrast of columns that are hardly wider than a pixel. What is claimed must be true, but for what
// the straight line between two pixels does to a border of an edge sharper than they are: up to a third of a pixel,
// which sigma tells of only where borders scatter, not where columns are a whole number of pixels wide. No word is
// several columns off.
TEST(GrayDecoder, AFinestBitThatTheLensBlursAwayCostsNoMoreThanSigmaSays) {
  for (double const wide : {1.0, 1.2, 1.5, 1.9, 2.0, 2.6, 3.0})
    for (double const blur : {0.6, 1.0, 1.5}) {
      Pictures pictures;
      pictures.column = [&](int x, int y) { return 1.3 + x / wide + 0.012 * y; };
      pictures.size.width = static_cast<int>(29 * wide);  // columns 1 to 31
      pictures.blur_px = blur;
      pictures.noise = 1;
      CodeImage const image = decoded(pictures, pairs());
      int wrong = 0, count = 0;
      for (int y = 0; y < image.code.rows; ++y)
        for (int x = 0; x < image.code.cols; ++x) {
          if (!image.has_code(x, y)) continue;
          double const off = std::abs(static_cast<double>(image.code(y, x)) - pictures.column(x, y));
          ++count;
          wrong += off > 5 * static_cast<double>(image.sigma(y, x)) + 0.33 / wide;
          EXPECT_LT(off, 1.5) << x << ' ' << y;
        }
      EXPECT_LE(wrong, 0.005 * count) << "columns of " << wide << " pixels, blur of " << blur << ", codes " << count;
    }
}

}  // namespace
}  // namespace scanview
