#pragma once
#include <filesystem>

#include "viewer/layered/ldi_builder.h"
#include "viewer/layered/ldi_tree.h"

namespace scanview {

/// Whether a tree's sums are written too: needed to add images later, about twice as large as the tree itself, and
/// never read by what draws it.
enum class LdiKeep { sums, tree_alone };

/// Writes a tree whole or not at all; its bytes depend on the tree and the sums alone. `builder`: what it was built by.
/// Throws Error{io}.
void write_ldi(std::filesystem::path const& path, LdiTree const& tree, LdiBuilder const& builder, LdiKeep keep);

/// Maps the file: only cells that are drawn are read. Throws Error{bad_input} where it is no LDI tree, cut off or
/// damaged in what describes it; a damaged cell is found when it is first drawn (LdiTree::blocks). The file must not be
/// changed while the tree lives; write_ldi() puts a new one in its place.
LdiTree read_ldi(std::filesystem::path const& path);

/// What images can be added to. Throws Error{bad_input} as above, also where the tree was written without its sums.
LdiBuilder read_ldi_builder(std::filesystem::path const& path);

/// Whether it begins as write_ldi() writes.
bool is_ldi(std::filesystem::path const& path);

}  // namespace scanview
