#pragma once
#include <cstddef>
#include <vector>

#include "viewer/visibility/bit_rows.h"

namespace scanview {

/// Rows that together see all that any row sees, few of them: always the one next that sees most of what is not seen
/// yet (the greedy set cover, within a factor of ln n of the fewest; Chvátal 1979). The object-centred art gallery of
/// Meruvia 2002, section 5: where to put cameras.
std::vector<std::size_t> smallest_samples(BitRows const& rows);

}  // namespace scanview
