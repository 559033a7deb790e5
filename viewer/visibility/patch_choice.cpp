#include "viewer/visibility/patch_choice.h"

#include <algorithm>
#include <functional>
#include <queue>
#include <tuple>

namespace scanview {

std::vector<std::uint32_t> choose_patches(PatchHierarchy const& hierarchy, std::vector<std::uint64_t> const& cost,
                                          std::size_t count) {
  std::size_t const fine = hierarchy.fine.count(), nodes = fine + hierarchy.fusions.size();
  constexpr std::uint32_t kNone = ~std::uint32_t{0};
  std::vector<std::uint32_t> parent(nodes, kNone), begin(nodes);
  std::vector<std::uint8_t> whole_parts(hierarchy.fusions.size());  // how many parts of a fusion are patches now
  std::vector<bool> is_patch(nodes);
  for (std::uint32_t p = 0; p < fine; ++p) {
    begin[p] = p;
    is_patch[p] = true;
  }
  struct Candidate {
    std::uint64_t loss;
    std::uint32_t node;
    bool operator>(Candidate const& other) const { return std::tie(loss, node) > std::tie(other.loss, other.node); }
  };
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> cheapest;
  auto const part_is_whole = [&](std::uint32_t part) {
    std::uint32_t const node = parent[part];
    if (node == kNone || ++whole_parts[node - fine] < 2) return;
    auto const& [first, second] = hierarchy.fusions[node - fine];
    cheapest.push({cost[node] - std::min(cost[node], cost[first] + cost[second]), node});
  };
  for (std::uint32_t node = static_cast<std::uint32_t>(fine); node < nodes; ++node) {
    auto const& [first, second] = hierarchy.fusions[node - fine];
    parent[first] = parent[second] = node;
    begin[node] = std::min(begin[first], begin[second]);
  }
  for (std::uint32_t p = 0; p < fine; ++p) part_is_whole(p);
  for (std::size_t left = fine; left > count && !cheapest.empty(); --left) {
    std::uint32_t const node = cheapest.top().node;
    cheapest.pop();
    auto const& [first, second] = hierarchy.fusions[node - fine];
    is_patch[first] = is_patch[second] = false;
    is_patch[node] = true;
    part_is_whole(node);
  }
  std::vector<std::uint32_t> begins;
  for (std::uint32_t node = 0; node < nodes; ++node) {
    if (is_patch[node]) begins.push_back(begin[node]);
  }
  std::sort(begins.begin(), begins.end());
  begins.push_back(static_cast<std::uint32_t>(fine));
  return begins;
}

}  // namespace scanview
