#include "base/random.h"

#include <gtest/gtest.h>

#include <cmath>

namespace scanview {
namespace {

TEST(CounterRandom, TheStreamIsAFunctionOfItsKeys) {
  CounterRandom a(1, 2, 3), b(1, 2, 3), c(1, 2, 4), d(1, 3, 3), e(2, 2, 3);
  auto const first = a.bits();
  EXPECT_EQ(first, b.bits());
  EXPECT_NE(first, c.bits());
  EXPECT_NE(first, d.bits());
  EXPECT_NE(first, e.bits());
}

TEST(CounterRandom, MomentsAreThoseOfTheDistributions) {
  constexpr int kCount = 200'000;
  double sum = 0, squares = 0, uniform = 0;
  for (int item = 0; item < kCount; ++item) {  // one number a stream: streams must be independent of each other
    CounterRandom random(7, static_cast<std::uint64_t>(item));
    double const x = random.normal();
    sum += x;
    squares += x * x;
    uniform += random.uniform();
  }
  // Five standard deviations of the mean (1/sqrt n), of the variance (sqrt 2/n), and of a uniform mean (1/sqrt 12 n).
  EXPECT_NEAR(sum / kCount, 0, 5 / std::sqrt(kCount));
  EXPECT_NEAR(squares / kCount, 1, 5 * std::sqrt(2.0 / kCount));
  EXPECT_NEAR(uniform / kCount, 0.5, 5 / std::sqrt(12.0 * kCount));
}

TEST(CounterRandom, BelowStaysBelow) {
  CounterRandom random(1, 1);
  int counts[3] = {};
  for (int i = 0; i < 3000; ++i) ++counts[random.below(3)];
  // Five standard deviations of a binomial count: 5 sqrt(3000 / 3 * 2 / 3) = 129.
  for (int const count : counts) EXPECT_NEAR(count, 1000, 130);
}

}  // namespace
}  // namespace scanview
