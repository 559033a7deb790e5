#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/walkthrough/node_cache.h"
#include "viewer/walkthrough/walkthrough_options.h"
#include "viewer/window/window_options.h"

namespace scanview {

struct WalkWindowOptions : BasicWindowOptions {
  WalkthroughOptions rendering;
  NodeCacheOptions cache;  ///< its quality is `rendering`'s
  /// Throws Error{usage}.
  void validate() const;
};

struct WalkWindowResult {
  std::vector<std::string> failures;  ///< a line for each node that could not be read, in the end
  std::optional<FrameTimes> times;    ///< where they were asked for: along a circle through the first node
  double uncovered = 0;               ///< over those frames and the few before: mean share of pixels that no node shows
  double triangles = 0;               ///< over the same: mean number of triangles drawn
};

/// The interactive viewer of a walkthrough's folder; returns when the person closes it. walk_window_help() says the
/// mouse and the keys. Nodes are read while the person walks: what is missing is drawn as soon as it is there. Nodes
/// that fail are left out, named in the panel, and logged as warnings. Throws Error{io} where there is no display or
/// the OpenGL context is lost, Error{bad_input} for a damaged walkthrough.json.
WalkWindowResult view_walkthrough(std::filesystem::path const& folder, WalkWindowOptions const& options,
                                  Context& context);

}  // namespace scanview
