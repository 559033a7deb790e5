#pragma once
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/layered/ldi_renderer.h"
#include "viewer/window/window_options.h"

namespace scanview {

struct TreeWindowOptions : BasicWindowOptions {
  LdiRenderOptions rendering;
  /// While the eye moves, a frame is refined for about so long, and completed once it rests; 0: frames are always
  /// complete, as those that are measured are.
  double milliseconds = 30;
  /// Throws Error{usage}.
  void validate() const;
};

struct TreeWindowResult {
  std::vector<std::string> failures;  ///< what of the tree is damaged, where the person looked
  /// Where they were asked for: around the object, or of a turn on the spot, at the reference nearest to the centre.
  std::optional<FrameTimes> times;
  double cells = 0, splats = 0;  ///< over those frames and the few before: mean numbers of a frame
  double uncovered = 0;          ///< over the same: mean share of pixels that nothing covers
};

/// The interactive viewer of an LDI tree; returns when the person closes it. tree_window_help() says the mouse and the
/// keys. Damaged cells are left out of pictures; the panel says so, and a warning. Throws Error{io} where there
/// is no display or the OpenGL context is lost.
TreeWindowResult view_ldi_tree(std::shared_ptr<LdiTree const> tree, TreeWindowOptions const& options, Context& context);

}  // namespace scanview
