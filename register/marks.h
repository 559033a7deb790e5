#pragma once
#include <filesystem>

#include "acquire/scan_set.h"
#include "base/files.h"

namespace scanview {

/// Poses from points that were marked in two views or more: {"VIEW": {"POINT": [u, v], ...}, ...}, pixels with a depth.
/// The first view keeps its camera's coordinates; of the others, the one that shares most marks with those placed so
/// far comes next and is fitted to them (Umeyama 1991). Throws Error{bad_input, path} naming the view that has no
/// marks, a mark without depth, or a view whose marks do not determine its pose (fewer than three in common, or on one
/// line).
void place_by_marks(std::filesystem::path const& path, Json const& marks, ScanSet& set);

}  // namespace scanview
