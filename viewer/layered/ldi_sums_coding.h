#pragma once
#include <filesystem>
#include <string>
#include <string_view>

#include "viewer/layered/ldi_builder.h"

namespace scanview {

/// The sums of all cells as bytes that depend on them alone: cells in LdiTree's order, in them faces, rows, columns and
/// depth bins upwards. Numbers are written in groups of seven bits, the lowest first, each as its difference from what
/// the sum before it lets expect: the same depth, colour and slope at its own weight. Some 17 to 20
/// bytes a sum, of 48 in memory.
std::string encode_sums(LdiSumCells const& cells);

/// What encode_sums() gave. Throws Error{bad_input, path} where the bytes are not such sums; counts are
/// checked against the bytes that are there.
LdiSumCells decode_sums(std::string_view bytes, LdiOptions const& options, std::filesystem::path const& path);

}  // namespace scanview
