#include "synth/group_cover.h"

#include <algorithm>
#include <bit>
#include <limits>
#include <optional>
#include <span>
#include <tuple>

#include "base/random.h"

namespace scanview {
namespace {

using Sets = std::vector<std::size_t>;
using Words = std::vector<std::uint64_t>;

/// How far from covered; less is better, in this order. missing: of every group, its weight times the bits of the
/// number of uncovered items beyond the spare ones, so that many small gaps count as a large one does.
struct Lack {
  std::uint64_t missing = 0, uncovered = 0;
  bool operator<(Lack const& other) const {
    return std::tie(missing, uncovered) < std::tie(other.missing, other.uncovered);
  }
};

constexpr Lack kWorst{std::numeric_limits<std::uint64_t>::max(), std::numeric_limits<std::uint64_t>::max()};

/// Bits of a without those of b. Adds within the words, which the compiler turns into vector code: the baseline
/// processor has no instruction for it.
std::uint64_t count_without(std::uint64_t const* a, std::uint64_t const* b, std::size_t words) {
  std::uint64_t sum = 0;
  for (std::size_t w = 0; w < words; ++w) {
    std::uint64_t x = a[w] & ~b[w];
    x -= (x >> 1) & 0x5555555555555555;
    x = (x & 0x3333333333333333) + ((x >> 2) & 0x3333333333333333);
    x = (x + (x >> 4)) & 0x0f0f0f0f0f0f0f0f;
    x += x >> 8;
    x += x >> 16;
    sum += (x + (x >> 32)) & 0x7f;
  }
  return sum;
}

/// Chosen sets and what they cover, with a weight for what each group is missing.
class Search {
 public:
  explicit Search(GroupCoverProblem const& problem)
      : problem_(problem), row_(problem.groups * problem.words), nothing_(problem.words) {
    restart({});
  }

  Sets const& chosen() const { return chosen_; }

  /// Other sets, all weights one.
  void restart(Sets sets) {
    chosen_ = std::move(sets);
    weights_.assign(problem_.groups, 1);
    count();
  }

  Lack lack() const {
    Lack result;
    for (std::size_t group = 0; group < problem_.groups; ++group) add(result, group, left_, nothing_.data());
    return result;
  }

  std::size_t excess() const {
    std::size_t sum = 0;
    for (std::size_t const group : unsatisfied())
      sum += count_without(left_.data() + group * problem_.words, nothing_.data(), problem_.words) -
             static_cast<std::size_t>(problem_.spare);
    return sum;
  }

  /// The lack without each of the chosen sets.
  std::vector<Lack> lacks_without_one() const {
    std::vector<Lack> lacks(chosen_.size());
    Words left;
    for (std::size_t i = 0; i < chosen_.size(); ++i) {
      left = left_;
      for (std::size_t w = 0; w < row_; ++w) left[w] |= members(chosen_[i])[w] & once_[w];
      for (std::size_t group = 0; group < problem_.groups; ++group) add(lacks[i], group, left, nothing_.data());
    }
    return lacks;
  }

  void remove(std::size_t i) {
    chosen_.erase(chosen_.begin() + static_cast<std::ptrdiff_t>(i));
    count();
  }

  /// Groups with more uncovered items than are spare.
  std::vector<std::size_t> unsatisfied() const {
    std::vector<std::size_t> groups;
    for (std::size_t group = 0; group < problem_.groups; ++group) {
      Lack lack;
      add(lack, group, left_, nothing_.data());
      if (lack.missing > 0) groups.push_back(group);
    }
    return groups;
  }

  /// Adds the set that leaves the least lack, the first of several, none of `refused`; one that helps `group`, where
  /// there is one.
  void add_best(std::span<std::size_t const> refused, std::optional<std::size_t> helped = std::nullopt) {
    std::vector<std::size_t> open;
    for (std::size_t group = 0; group < problem_.groups; ++group)
      if (count_without(left_.data() + group * problem_.words, nothing_.data(), problem_.words) > 0)
        open.push_back(group);
    std::uint64_t const helped_left =
        helped ? count_without(left_.data() + *helped * problem_.words, nothing_.data(), problem_.words) : 0;
    std::size_t best = 0;
    Lack least = kWorst;
    for (std::size_t set = 0; set < problem_.sets; ++set) {
      if (std::ranges::find(refused, set) != refused.end()) continue;
      if (helped && count_without(left_.data() + *helped * problem_.words, members(set) + *helped * problem_.words,
                                  problem_.words) == helped_left)
        continue;
      Lack lack;
      for (std::size_t const group : open) {
        add(lack, group, left_, members(set) + group * problem_.words);
        if (lack.missing > least.missing) break;
      }
      if (lack < least) {
        least = lack;
        best = set;
      }
    }
    chosen_.push_back(best);
    count();
  }

  void raise_weights(std::vector<std::size_t> const& groups) {
    for (std::size_t const group : groups) ++weights_[group];
  }

 private:
  std::uint64_t const* members(std::size_t set) const { return problem_.members.data() + set * row_; }

  void add(Lack& lack, std::size_t group, Words const& left, std::uint64_t const* members) const {
    std::uint64_t const uncovered = count_without(left.data() + group * problem_.words, members, problem_.words);
    auto const spare = static_cast<std::uint64_t>(problem_.spare);
    lack.uncovered += uncovered;
    if (uncovered > spare)
      lack.missing += weights_[group] * static_cast<std::uint64_t>(std::bit_width(uncovered - spare));
  }

  void count() {
    left_ = problem_.items;
    once_.assign(row_, 0);
    for (std::size_t const set : chosen_)
      for (std::size_t w = 0; w < row_; ++w) {
        std::uint64_t const held = members(set)[w];
        once_[w] = (once_[w] & ~held) | (held & left_[w]);
        left_[w] &= ~held;
      }
  }

  GroupCoverProblem const& problem_;
  std::size_t row_;
  Words nothing_;
  Sets chosen_;
  Words left_;  ///< items that no chosen set holds
  Words once_;  ///< items that a single one holds
  std::vector<std::uint64_t> weights_;
};

std::size_t least(std::vector<Lack> const& lacks) {
  return static_cast<std::size_t>(std::min_element(lacks.begin(), lacks.end()) - lacks.begin());
}

/// Tries to cover with as many sets as are chosen; how that ended is in search.lack(). Each step takes away the set
/// that is missed the least and adds the best other; groups that stay uncovered weigh more with every step, which leads
/// out of every local optimum (row weighting: Gao, Yao, Weise, Li 2015).
void exchange(Search& search, int steps, CounterRandom random, Context const& context) {
  constexpr std::size_t kTabu = 3;  // steps for which what was just taken away stays away
  std::vector<std::size_t> refused;
  for (int step = 0; step < steps && search.lack().missing > 0; ++step) {
    context.check_cancelled();
    auto lacks = search.lacks_without_one();
    if (lacks.size() > 1 && step > 0) lacks.back() = kWorst;  // just added
    std::size_t const leaving = least(lacks);
    refused.push_back(search.chosen()[leaving]);
    if (refused.size() > kTabu) refused.erase(refused.begin());
    search.remove(leaving);
    auto const lacking = search.unsatisfied();
    if (lacking.empty()) return;
    search.add_best(refused, lacking[random.below(static_cast<std::uint32_t>(lacking.size()))]);
    search.raise_weights(search.unsatisfied());
  }
}

/// Exchanges sets as long as that lowers the lack.
void descend(Search& search) {
  for (bool better = true; better;) {
    better = false;
    for (std::size_t i = 0; i < search.chosen().size(); ++i) {
      Sets const before = search.chosen();
      Lack const current = search.lack();
      search.remove(0);
      search.add_best({});
      if (search.lack() < current) {
        better = true;
        continue;
      }
      Sets turned(before.begin() + 1, before.end());
      turned.push_back(before.front());
      search.restart(turned);
    }
  }
}

}  // namespace

GroupCover cover_groups(GroupCoverProblem const& problem, std::size_t most_sets, int steps, Context const& context) {
  Search search(problem);
  GroupCover cover;
  for (Lack current = search.lack(); current.missing > 0;) {
    search.add_best({});
    if (!(search.lack() < current)) {
      search.remove(search.chosen().size() - 1);
      cover.ended = CoverEnd::no_gain;
      break;
    }
    current = search.lack();
  }
  if (cover.ended == CoverEnd::covered) {
    Sets covering = search.chosen();
    while (covering.size() > 1) {
      search.restart(covering);
      search.remove(least(search.lacks_without_one()));
      exchange(search, steps, CounterRandom(context.seed, covering.size()), context);
      if (search.lack().missing > 0) break;
      covering = search.chosen();
    }
    search.restart(covering);
  }
  if (search.chosen().size() > most_sets) cover.ended = CoverEnd::most_sets;
  while (search.chosen().size() > most_sets) search.remove(least(search.lacks_without_one()));
  descend(search);
  cover.sets = search.chosen();
  std::ranges::sort(cover.sets);
  cover.uncovered = search.lack().uncovered;
  cover.excess = search.excess();
  return cover;
}

}  // namespace scanview
