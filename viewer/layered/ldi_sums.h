#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "viewer/layered/ldi_lattice.h"

namespace scanview {

inline constexpr int kLdiFullWeight = 256;  ///< of a grid point that is covered once

/// What has been splatted to one place of a cell: sums of integers, which do not depend on the order of what is summed.
struct LdiSum {
  std::uint32_t next = 0;                      ///< the next farther one in its column; 0: none
  std::uint32_t bin = 0;                       ///< depth in bins, rounded down
  std::uint32_t weight = 0;                    ///< kLdiFullWeight where covered once
  std::uint32_t depth = 0;                     ///< Σ weight · (beyond the bin's start, 1/256 bin)
  std::uint64_t red = 0, green = 0, blue = 0;  ///< Σ weight · (linear light, stamp.h)
  std::uint32_t slope_x = 0, slope_y = 0;      ///< Σ weight · (slope · 127 + 128)
};

/// The sums of one cell, in columns: one for each grid point of each face, from near to far. Faces kLdiFaces and
/// up are those of rims (Stamp::rim).
class LdiSums {
 public:
  static constexpr int kFaces = 2 * kLdiFaces;
  /// Sums of weights above this could overflow: of sixty thousand whole pictures.
  static constexpr std::uint32_t kMostWeight = 0xffffffffU / 256;

  /// Bins are 2^bin_shift grid steps deep.
  explicit LdiSums(int resolution, int bin_shift = 0)
      : resolution_(static_cast<std::size_t>(resolution)), bin_shift_(bin_shift), pool_(1) {}

  /// The sum at a grid point of a face and a depth bin, made where there is none. Valid until the next call.
  LdiSum& at(int face, int x, int y, std::uint32_t bin);
  /// The first of a column, 0 where it is empty; and others by their number.
  std::uint32_t first(int face, int x, int y) const {
    auto const& heads = heads_[static_cast<std::size_t>(face)];
    return heads.empty() ? 0 : heads[static_cast<std::size_t>(y) * resolution_ + static_cast<std::size_t>(x)];
  }
  LdiSum const& operator[](std::uint32_t number) const { return pool_[number]; }
  bool has_face(int face) const { return !heads_[static_cast<std::size_t>(face)].empty(); }
  std::size_t count() const { return pool_.size() - 1; }
  int resolution() const { return static_cast<int>(resolution_); }
  int bin_shift() const { return bin_shift_; }
  int bin_steps() const { return 1 << bin_shift_; }

 private:
  std::size_t resolution_;
  int bin_shift_;
  std::vector<std::uint32_t> heads_[kFaces];
  std::vector<LdiSum> pool_;
};

inline LdiSum& LdiSums::at(int face, int x, int y, std::uint32_t bin) {
  auto& heads = heads_[static_cast<std::size_t>(face)];
  if (heads.empty()) heads.resize(resolution_ * resolution_);
  std::uint32_t* link = &heads[static_cast<std::size_t>(y) * resolution_ + static_cast<std::size_t>(x)];
  while (*link != 0 && pool_[*link].bin < bin) link = &pool_[*link].next;
  if (*link != 0 && pool_[*link].bin == bin) return pool_[*link];
  LdiSum made;
  made.next = *link;
  made.bin = bin;
  std::uint32_t const number = static_cast<std::uint32_t>(pool_.size());
  *link = number;  // before the pool moves
  pool_.push_back(made);
  return pool_.back();
}

}  // namespace scanview
