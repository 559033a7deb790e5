#pragma once
#include <algorithm>
#include <cstdint>

#include "viewer/layered/ldi_lattice.h"

namespace scanview {

/// LdiTree's order of cells: coarse levels first, so that parents come before their children.
inline bool in_ldi_order(LdiCellKey const& a, LdiCellKey const& b) {
  return a.level != b.level ? a.level > b.level : a.index < b.index;
}

/// Steps of stamps of any size that a float can have, and of what lies above them, have levels within ±200. Grid points
/// farther than 2^44 from the origin have places that a double keeps with less than eight bits behind the point.
inline constexpr int kLdiFarthestLevel = 200;
inline constexpr std::int64_t kLdiFarthestGridPoint = std::int64_t{1} << 44;

/// Whether a cell can be there: all that is computed from its key is finite.
inline bool is_ldi_key(LdiCellKey const& key) {
  return key.level >= -kLdiFarthestLevel && key.level <= kLdiFarthestLevel &&
         std::all_of(key.index.begin(), key.index.end(), [](std::int64_t index) {
           return index >= -2 * kLdiFarthestGridPoint && index <= 2 * kLdiFarthestGridPoint;
         });
}

}  // namespace scanview
