#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "viewer/visibility/bit_rows.h"

namespace scanview {

/// What a row's bits are expected to be: earlier rows (−1: none) that see from nearby, and where its eye is.
struct RowPlace {
  std::int32_t beside[4] = {-1, -1, -1, -1};      ///< the two it lies between, then two across
  std::int32_t twin = -1;                         ///< the same direction on the shell before
  Eigen::Vector4d eye = Eigen::Vector4d::Zero();  ///< homogeneous, w 0: infinitely far; all 0: many eyes
};
/// And a patch's: its mean normal and where it is, in the eye's coordinates.
struct PatchPlace {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero(), center = Eigen::Vector3d::Zero();
};

/// Any bits in a row, as their context the two before; where they are mostly equal they cost little.
std::string encode_flags(std::vector<bool> const& flags);
std::vector<bool> decode_flags(std::string_view bytes, std::size_t count, std::filesystem::path const& path);

/// Bits as an adaptive binary range coder keeps them (Martin 1979; probabilities of 12 bits as in LZMA). A bit's
/// context is how its patch faces the row's eye, what the rows nearby have in its column, and what the row has in the
/// two patches before, which lie beside it on the model: visibility changes along lines, on the sphere as on the
/// surface. Two columns a patch: VisibilityField::rows.
std::string encode_bits(BitRows const& bits, std::vector<RowPlace> const& rows, std::vector<PatchPlace> const& patches);
/// Throws Error{bad_input, path} where the bytes cannot hold so many bits; bytes that are not what was written give
/// other bits, never a read beyond their end: the file's check sum tells.
BitRows decode_bits(std::string_view bytes, std::vector<RowPlace> const& rows, std::vector<PatchPlace> const& patches,
                    std::filesystem::path const& path);

}  // namespace scanview
