#include "viewer/visibility/smallest_samples.h"

#include <bit>
#include <cstdint>
#include <queue>
#include <utility>

namespace scanview {

std::vector<std::size_t> smallest_samples(BitRows const& rows) {
  std::vector<std::uint64_t> seen((rows.columns() + 63) / 64);
  auto const gain = [&](std::size_t row) {
    std::size_t sum = 0;
    auto const bits = rows.row(row);
    for (std::size_t w = 0; w < bits.size(); ++w) sum += static_cast<std::size_t>(std::popcount(bits[w] & ~seen[w]));
    return sum;
  };
  // Gains only fall: one that is still the largest after it was counted again is the largest. Of equal ones the first.
  using Candidate = std::pair<std::size_t, std::int64_t>;
  std::priority_queue<Candidate> best;
  for (std::size_t row = 0; row < rows.rows(); ++row) best.emplace(gain(row), -static_cast<std::int64_t>(row));
  std::vector<std::size_t> chosen;
  while (!best.empty() && best.top().first > 0) {
    auto const row = static_cast<std::size_t>(-best.top().second);
    best.pop();
    std::size_t const now = gain(row);
    if (!best.empty() && Candidate(now, -static_cast<std::int64_t>(row)) < best.top()) {
      best.emplace(now, -static_cast<std::int64_t>(row));
      continue;
    }
    if (now == 0) break;
    auto const bits = rows.row(row);
    for (std::size_t w = 0; w < bits.size(); ++w) seen[w] |= bits[w];
    chosen.push_back(row);
  }
  return chosen;
}

}  // namespace scanview
