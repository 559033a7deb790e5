#include "base/context.h"

#include <gtest/gtest.h>

#include <atomic>
#include <numeric>

#include "base/parallel.h"
#include "tests/expect_error.h"

namespace scanview {
namespace {

TEST(Context, CancelStopsTheWork) {
  Context context;
  std::atomic<bool> cancelled = false;
  context.cancelled = &cancelled;
  EXPECT_NO_THROW(context.check_cancelled());
  cancelled = true;
  EXPECT_SCANVIEW_ERROR(context.check_cancelled(), ErrorCode::interrupted, "interrupted");
  EXPECT_SCANVIEW_ERROR(for_each_index(context, 10, [](std::size_t) {}), ErrorCode::interrupted, "interrupted");
}

TEST(Context, WarningsAreRemembered) {
  Context context;
  context.warn("one");
  context.warn("two");
  EXPECT_EQ(context.warnings(), (std::vector<std::string>{"one", "two"}));
}

TEST(Parallel, EveryIndexOnceForAnyNumberOfThreads) {
  for (int threads : {0, 1, 2, 5}) {
    Context context;
    context.threads = threads;
    std::vector<int> seen(1000);
    for_each_index(context, seen.size(), [&](std::size_t i) { ++seen[i]; });
    EXPECT_EQ(std::accumulate(seen.begin(), seen.end(), 0), 1000);
    EXPECT_EQ(*std::max_element(seen.begin(), seen.end()), 1);
  }
}

TEST(Parallel, TheFirstFailureByIndexIsReported) {
  Context context;
  auto const work = [](std::size_t i) {
    if (i % 7 == 3) throw Error(ErrorCode::bad_input, {}, "item " + std::to_string(i));
  };
  EXPECT_SCANVIEW_ERROR(for_each_index(context, 100, work), ErrorCode::bad_input, "item 3");
}

TEST(Parallel, ProgressReachesTheTotalAndNeverFalls) {
  Context context;
  std::size_t last = 0, calls = 0;
  context.on_progress = [&](std::string const& stage, std::size_t, std::size_t total) {
    EXPECT_EQ(stage, "stage");
    EXPECT_EQ(total, 50U);
    ++calls;
    last = std::max(last, calls);
  };
  for_each_index(
      context, 50, [](std::size_t) {}, "stage");
  EXPECT_EQ(calls, 50U);
}

}  // namespace
}  // namespace scanview
