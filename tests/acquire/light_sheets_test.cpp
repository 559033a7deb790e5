#include "acquire/light_sheets.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>

#include "base/random.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
using Match = LightSheets::Match;

/// A fan of light from one axis, and what it passes. In mm and the rectified frame, like the matches of a view.
struct Source {
  Vector3d axis_at = {60, -30, 20}, axis = Vector3d(0.1, 1, 0.05).normalized();
  double range = 32;  ///< of codes
  /// The light's number where the tangent of its angle about the axis is t, -0.6 to 0.6.
  std::function<double(double)> code = [](double t) { return 32 * (t / 1.2 + 0.5); };
  /// Depth of a ray's surface.
  std::function<double(CounterRandom&, double, double)> depth = [](CounterRandom& random, double, double) {
    return 420 + 260 * random.uniform();
  };
  double sigma = 0;  ///< of the difference of both cameras' codes: half of it is what the place has, about

  double code_at(Match const& m) const {
    Vector3d const p = Vector3d(m.a, m.b, 1) / m.q - axis_at;
    Vector3d const across = axis.cross(Vector3d::UnitZ()).normalized(), ahead = across.cross(axis);
    return code(p.dot(across) / p.dot(ahead));
  }
  /// A right match: the code is as far off as tolerance() expects.
  Match match(std::uint64_t seed, std::uint64_t item) const {
    for (std::uint64_t attempt = 0;; ++attempt) {
      CounterRandom random(seed, item, attempt);
      Match m{0.8 * random.uniform() - 0.4, 0.6 * random.uniform() - 0.3, 0, 0, std::max(sigma, 1e-6)};
      m.q = 1 / depth(random, m.a, m.b);
      m.code = code_at(m) + 0.5 * sigma * random.normal();
      if (m.code > 0 && m.code < range) return m;
    }
  }
  /// `wrong` of them have any code at all.
  std::vector<Match> matches(std::uint64_t seed, std::size_t count, double wrong = 0) const {
    std::vector<Match> result;
    auto const first_right = static_cast<std::size_t>(wrong * static_cast<double>(count));
    for (std::size_t i = 0; i < count; ++i) {
      result.push_back(match(seed, i));
      if (i < first_right) result.back().code = range * CounterRandom(seed + 1000, i).uniform();
    }
    return result;
  }
};

/// The share of matches whose residual is within tolerance.
double accepted(LightSheets const& sheets, std::vector<Match> const& matches, std::size_t from, std::size_t to) {
  std::size_t count = 0;
  for (std::size_t i = from; i < to; ++i)
    count += std::abs(sheets.residual(matches[i])) <= sheets.tolerance(matches[i]);
  return static_cast<double>(count) / static_cast<double>(to - from);
}

// Light that moves evenly along a line is a straight h, and the model then has no error of its own.
TEST(LightSheets, AnEvenSourceIsFoundExactly) {
  Source const source;
  LightSheets const sheets(source.matches(31, 1000));
  ASSERT_TRUE(sheets.usable());
  for (std::uint64_t i = 0; i < 500; ++i) {
    Match const m = source.match(32, i);  // others than those of the fit
    EXPECT_NEAR(sheets.residual(m), 0, 1e-5 * source.range) << "seed 32, item " << i;
    // The same place with another code: the difference, of the sign that the header says.
    Match wrong = m;
    wrong.code -= 3;
    EXPECT_NEAR(sheets.residual(wrong), 3, 1e-5 * source.range);
  }
}

// A mirror that turns evenly: code goes by the angle. h is straight between 25 knots, off by h'' step² / 8 there: with
// t = tan(angle), |t| <= 0.6, h'' = 2 t (1 + t²) <= 1.7 and a step of 1.09 / 24 radians, 4.4e-4 of tangent or 0.013
// codes at the ends, which noise of 0.1 / 2 covers.
TEST(LightSheets, AMirrorThatTurnsEvenlyIsWithinTheTolerance) {
  Source source;
  source.code = [](double t) { return 32 * (std::atan(t) / (2 * std::atan(0.6)) + 0.5); };
  source.sigma = 0.1;
  LightSheets const sheets(source.matches(33, 3000));
  ASSERT_TRUE(sheets.usable());
  auto const others = source.matches(34, 3000);
  // Five deviations; but beyond the outermost knots that five matches decide, h goes on as a straight line.
  EXPECT_GE(accepted(sheets, others, 0, others.size()), 0.999);
  double squares = 0;
  for (Match const& m : others) squares += sheets.residual(m) * sheets.residual(m);
  // RMS of 3000 is known to 1.3 %: sqrt(0.05² + 0.013²) and three deviations, and a fifth for those ends.
  EXPECT_LT(std::sqrt(squares / 3000), 0.065);
  EXPECT_LT(sheets.scatter(), 0.03);
}

TEST(LightSheets, AThirdOfWrongMatchesDoesNotMoveIt) {
  for (std::uint64_t seed = 40; seed < 60; ++seed) {
    SCOPED_TRACE(testing::Message() << "seed " << seed);
    Source source;
    source.sigma = 0.1;
    auto const matches = source.matches(seed, 1500, 1.0 / 3);
    LightSheets const sheets(matches);
    ASSERT_TRUE(sheets.usable());
    EXPECT_EQ(accepted(sheets, matches, 500, 1500), 1);
    // A code of chance is within the tolerance by 2 tolerance / range of all: at most 3 Poisson deviations more.
    double const by_chance = 500 * 2 * sheets.tolerance(matches[0]) / source.range;
    EXPECT_LE(500 * accepted(sheets, matches, 0, 500), by_chance + 3 * std::sqrt(by_chance) + 1);
    // Noise of 0.05 and what Tukey's weights leave of it: the tolerance is not opened by what is wrong.
    EXPECT_LT(sheets.tolerance(matches[0]), 2 * 5 * 0.05);
  }
}

TEST(LightSheets, LightMayGoEitherWay) {
  Source source;
  source.sigma = 0.05;
  source.code = [](double t) { return 32 * (0.5 - t / 1.2); };
  auto const matches = source.matches(50, 1500, 0.2);
  LightSheets const sheets(matches);
  ASSERT_TRUE(sheets.usable());
  EXPECT_EQ(accepted(sheets, matches, 300, 1500), 1);
}

// Light that starts slowly and ends four times as fast. h between knots is off by h'' step² / 8 at most, 0.02 codes
// where it is slowest; noise has 0.05.
TEST(LightSheets, LightMayMoveUnevenly) {
  Source source;
  source.sigma = 0.1;
  source.code = [](double t) {
    double const u = t / 1.2 + 0.5;
    return 32 * u * (0.4 + 0.6 * u);
  };
  auto const matches = source.matches(53, 3000, 0.2);
  LightSheets const sheets(matches);
  ASSERT_TRUE(sheets.usable());
  EXPECT_GE(accepted(sheets, matches, 600, 3000), 0.999);
}

// On one plane inverse depth is a linear function of the direction, and 0 / 0 explains all codes.
TEST(LightSheets, APlaneAloneTellsNoSource) {
  Source source;
  source.sigma = 0.05;
  source.depth = [](CounterRandom&, double a, double b) { return 580 / (1 - 0.2 * a - 0.1 * b); };
  EXPECT_FALSE(LightSheets(source.matches(51, 1500)).usable());
}

TEST(LightSheets, TheOrderOfMatchesDoesNotMatter) {
  Source source;
  source.sigma = 0.1;
  auto matches = source.matches(52, 1200, 0.25);
  LightSheets const one(matches);
  std::reverse(matches.begin(), matches.end());
  LightSheets const other(matches);
  // Sums of 1200 terms in another order, through twelve rounds.
  for (Match const& m : matches) EXPECT_NEAR(one.residual(m), other.residual(m), 1e-6 * source.range);
}

TEST(LightSheets, FewerThanThreeHundredMatchesTellNothing) {
  Source const source;
  EXPECT_FALSE(LightSheets({}).usable());
  EXPECT_FALSE(LightSheets(source.matches(60, 1)).usable());
  EXPECT_FALSE(LightSheets(source.matches(60, 299)).usable());
  EXPECT_TRUE(LightSheets(source.matches(60, 300)).usable());
}

TEST(LightSheets, MatchesThatAgreeOnNoSourceAreNotUsed) {
  Source const source;
  EXPECT_FALSE(LightSheets(source.matches(61, 2000, 1)).usable()) << "codes of chance";
  // Half the matches of one light, half of another elsewhere: neither is two thirds.
  Source turned;
  turned.axis = Vector3d::UnitX();
  auto both = source.matches(62, 1000);
  for (Match const& m : turned.matches(63, 1000)) both.push_back(m);
  EXPECT_FALSE(LightSheets(both).usable()) << "two lights";
  auto same = source.matches(64, 1000);
  for (Match& m : same) m.code = 7;
  EXPECT_FALSE(LightSheets(same).usable()) << "one code";
  auto point = std::vector<Match>(1000, source.match(65, 0));
  EXPECT_FALSE(LightSheets(point).usable()) << "one place";
}

}  // namespace
}  // namespace scanview
