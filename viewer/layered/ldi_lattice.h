#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <compare>
#include <cstdint>

namespace scanview {

/// The grids of all levels lie in space once and for all, so that a tree does not depend on which image came first:
/// grid steps are powers of two (of the set's unit), and cells of level e have a side of `resolution` · 2^e and begin
/// at multiples of it from kLdiOrigin.
///
/// A face of a cell, an LDI's projection plane (Chang 1998, §3), is that of an axis, seen from one side: a pixel lies
/// on the face that its surface turns to most. So a surface's slope against its plane is at most 1 along each axis, it
/// keeps its sampling rate however it is turned, and the two sides of a thin wall never mix. Face 2 a + s: depth along
/// axis a, normals towards its negative (s = 0) or positive (s = 1) end; x along axis (a + 1) % 3, y along (a + 2) % 3.
inline constexpr int kLdiFaces = 6;
inline constexpr int kLdiLeastResolution = 1, kLdiGreatestResolution = 256;

/// Away from round numbers: walls are often built at these, and would lie on the borders of cells and depth bins.
inline Eigen::Vector3d ldi_origin() { return {0.2137854, 0.3721569, 0.2869143}; }

struct LdiCellKey {
  int level = 0;  ///< exponent of the grid step
  std::array<std::int64_t, 3> index{};
  auto operator<=>(LdiCellKey const&) const = default;

  LdiCellKey parent() const { return {level + 1, {index[0] >> 1, index[1] >> 1, index[2] >> 1}}; }
};
struct LdiCellKeyHash {
  std::size_t operator()(LdiCellKey const& key) const {
    std::uint64_t hash = static_cast<std::uint64_t>(key.level) * 0x9e3779b97f4a7c15U;
    for (std::int64_t const i : key.index) {
      hash ^= static_cast<std::uint64_t>(i);
      hash *= 0xff51afd7ed558ccdU;
      hash ^= hash >> 32;
    }
    return static_cast<std::size_t>(hash);
  }
};

inline double ldi_step(int level) { return std::ldexp(1.0, level); }
inline Eigen::Vector3d ldi_corner(LdiCellKey const& key, int resolution) {
  double const side = resolution * ldi_step(key.level);
  return ldi_origin() + side * Eigen::Vector3d(double(key.index[0]), double(key.index[1]), double(key.index[2]));
}

/// The paper's bound on the number of levels below the root: H = ⌈log2(L / (N d))⌉, at least 0; L: the longest side of
/// the scene's box, N: resolution, d: the smallest feature that matters (Chang 1998, §3.6).
inline int ldi_height_bound(double longest_side, int resolution, double smallest_feature) {
  return std::max(0, static_cast<int>(std::ceil(std::log2(longest_side / (resolution * smallest_feature)))));
}

}  // namespace scanview
