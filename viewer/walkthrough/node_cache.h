#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>

#include "viewer/walkthrough/node_library.h"

namespace scanview {

struct NodeCacheOptions {
  std::size_t bytes = std::size_t{1} << 30;  ///< that nodes in memory may take, about; the last one asked for stays
  int ahead = 4;                             ///< nodes nearest to where the eye will be that are read before asked for
  double seconds_ahead = 1;                  ///< how far ahead that is, at the eye's present velocity
  /// From so many walking radii on a node is drawn in the next coarser level, from twice as far in the one after it.
  double full_detail = 4;
  NodeQuality quality = NodeQuality::density;
  /// Throws Error{usage}.
  void validate() const;
};

/// The nodes of a walkthrough's folder (walkthrough_file.h) as a working set (Darsa 1998, §8): read by a thread of its
/// own, ahead of the eye or when asked for, and forgotten, those longest not asked for first, so that a scene larger
/// than memory can be walked through. A node that cannot be read is named in failures(), its coarser levels are tried,
/// and the others go on. Throws Error{bad_input} for a damaged walkthrough.json.
std::shared_ptr<NodeLibrary> open_node_library(std::filesystem::path const& folder,
                                               NodeCacheOptions const& options = {});

}  // namespace scanview
