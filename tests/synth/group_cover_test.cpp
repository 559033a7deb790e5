#include "synth/group_cover.h"

#include <gtest/gtest.h>

#include <bit>

#include "base/random.h"

namespace scanview {
namespace {

GroupCoverProblem random_problem(std::uint64_t seed, std::size_t sets, double density) {
  GroupCoverProblem problem;
  problem.sets = sets;
  problem.groups = 4;
  problem.words = 1;
  CounterRandom random(seed, 0);
  problem.items.assign(4, 0xffff);
  for (std::size_t i = 0; i < sets * 4; ++i) {
    std::uint64_t word = 0;
    for (int bit = 0; bit < 16; ++bit) word |= std::uint64_t{random.uniform() < density} << bit;
    problem.members.push_back(word);
  }
  return problem;
}

std::size_t excess_of(GroupCoverProblem const& problem, std::uint64_t chosen) {
  std::size_t excess = 0;
  for (std::size_t g = 0; g < problem.groups; ++g) {
    std::uint64_t left = problem.items[g];
    for (std::size_t s = 0; s < problem.sets; ++s)
      if (chosen >> s & 1) left &= ~problem.members[s * problem.groups + g];
    excess += static_cast<std::size_t>(std::max(0, std::popcount(left) - problem.spare));
  }
  return excess;
}

TEST(GroupCover, FindsTheFewestSetsOfSmallProblems) {
  int fewest_found = 0;
  for (std::uint64_t seed = 1; seed <= 40; ++seed) {
    GroupCoverProblem problem = random_problem(seed, 14, 0.4);
    problem.spare = static_cast<int>(seed % 3);
    int fewest = 100;
    for (std::uint64_t chosen = 0; chosen < 1 << 14; ++chosen)
      if (excess_of(problem, chosen) == 0) fewest = std::min(fewest, std::popcount(chosen));
    Context context;
    GroupCover const cover = cover_groups(problem, 100, 200, context);
    if (fewest == 100) {
      EXPECT_EQ(cover.ended, CoverEnd::no_gain);
      continue;
    }
    std::uint64_t chosen = 0;
    for (std::size_t const set : cover.sets) chosen |= std::uint64_t{1} << set;
    EXPECT_EQ(cover.ended, CoverEnd::covered);
    EXPECT_EQ(excess_of(problem, chosen), 0u) << "seed " << seed;
    EXPECT_EQ(cover.excess, 0u);
    EXPECT_LE(cover.sets.size(), static_cast<std::size_t>(fewest) + 1) << "seed " << seed;
    fewest_found += cover.sets.size() == static_cast<std::size_t>(fewest);
  }
  EXPECT_GE(fewest_found, 36);
}

TEST(GroupCover, ItemsThatNoSetHoldsEndTheSearch) {
  GroupCoverProblem problem = random_problem(3, 10, 0.5);
  problem.items[2] |= 1 << 20;
  Context context;
  GroupCover const cover = cover_groups(problem, 100, 5, context);
  EXPECT_EQ(cover.ended, CoverEnd::no_gain);
  EXPECT_EQ(cover.excess, 1u);
  EXPECT_EQ(cover.uncovered, 1u);
}

TEST(GroupCover, TooFewSetsAllowedLeaveTheLeast) {
  GroupCoverProblem const problem = random_problem(5, 14, 0.4);
  std::size_t least = 1000;
  for (std::uint64_t chosen = 0; chosen < 1 << 14; ++chosen)
    if (std::popcount(chosen) == 2) least = std::min(least, excess_of(problem, chosen));
  Context context;
  GroupCover const cover = cover_groups(problem, 2, 200, context);
  EXPECT_EQ(cover.ended, CoverEnd::most_sets);
  EXPECT_EQ(cover.sets.size(), 2u);
  EXPECT_LE(cover.excess, least + least / 4);
}

TEST(GroupCover, NothingToCoverNeedsNoSet) {
  GroupCoverProblem problem = random_problem(1, 5, 0.5);
  problem.spare = 16;
  Context context;
  EXPECT_TRUE(cover_groups(problem, 10, 5, context).sets.empty());
}

}  // namespace
}  // namespace scanview
