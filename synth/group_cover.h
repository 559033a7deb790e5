#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/context.h"

namespace scanview {

/// Which items each of some sets holds. Items are in groups, each with as many 64-bit words; `spare` items of each
/// group may stay uncovered.
struct GroupCoverProblem {
  std::size_t sets = 0, groups = 0, words = 0;
  std::vector<std::uint64_t> items;    ///< those that exist: groups x words
  std::vector<std::uint64_t> members;  ///< sets x groups x words
  int spare = 0;
};

enum class CoverEnd {
  covered,   ///< no group has more uncovered items than `spare`
  no_gain,   ///< no further set would help
  most_sets  ///< as many sets as were allowed
};

struct GroupCover {
  std::vector<std::size_t> sets;  ///< ascending
  std::size_t excess = 0;         ///< uncovered items beyond the spare ones, summed over groups
  std::size_t uncovered = 0;      ///< all of them
  CoverEnd ended = CoverEnd::covered;
};

/// Few sets that cover every group up to `spare`. First greedily: each set is the one that leaves the least (the bits
/// of the number of items beyond the spare ones, summed over groups; then the uncovered items; then the first). Then
/// with one set less, for as long as `steps` exchanges of a set find a cover: groups that stay uncovered gain weight
/// (row weighting: Gao, Yao, Weise, Li 2015). Last, exchanges that lower the uncovered items. Deterministic. Cost: a
/// step looks at the members of all sets in groups with uncovered items, and at all members of chosen sets; a
/// millisecond or two for some 500 sets and groups, so one thread does it all. Of the context: the seed, and
/// cancelling.
GroupCover cover_groups(GroupCoverProblem const& problem, std::size_t most_sets, int steps, Context const& context);

}  // namespace scanview
