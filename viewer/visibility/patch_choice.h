#pragma once
#include <cstdint>
#include <vector>

#include "viewer/visibility/patch_tree.h"

namespace scanview {

/// Which patches of a hierarchy to keep so that least is drawn in vain (the pruning of Breiman, Friedman, Olshen and
/// Stone 1984): patches fuse, cheapest first, until `count` are left. cost: of each node, how many triangles would be
/// drawn altogether if it were a patch; at least that of its parts. Returns the fine patches at which a patch begins,
/// ascending, and their end. n log n.
std::vector<std::uint32_t> choose_patches(PatchHierarchy const& hierarchy, std::vector<std::uint64_t> const& cost,
                                          std::size_t count);

}  // namespace scanview
