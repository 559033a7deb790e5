#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "viewer/visibility/bit_rows.h"

namespace scanview {

/// What is likely to be in a row: earlier rows (−1: none) that see from nearby. `beside`: the two it lies between, then
/// two across; `twin`: the same direction on the shell before.
struct RowNeighbors {
  std::int32_t beside[4] = {-1, -1, -1, -1};
  std::int32_t twin = -1;
};

/// Bits as an adaptive binary range coder keeps them (Martin 1979; probabilities of 12 bits as in LZMA). A bit's
/// context is what its neighbouring rows have in its column and what the row has in the two patches before, which lie
/// beside it on the model: visibility changes along lines, on the sphere as on the surface. Columns:
/// VisibilityField::rows.
std::string encode_bits(BitRows const& rows, std::vector<RowNeighbors> const& neighbors);
/// Throws Error{bad_input, path} where the bytes cannot hold so many bits; bytes that are not what was written give
/// other bits, never a read beyond their end: the file's check sum tells.
BitRows decode_bits(std::string_view bytes, std::size_t rows, std::size_t columns,
                    std::vector<RowNeighbors> const& neighbors, std::filesystem::path const& path);

}  // namespace scanview
