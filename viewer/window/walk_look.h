#pragma once
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "viewer/walkthrough/walkthrough_options.h"
#include "viewer/window/commands.h"

namespace scanview {

/// What is drawn where no node shows anything.
enum class GapLook {
  background,
  interpolated,  ///< VisibilityGaps::interpolated
  magenta,       ///< to be seen
};
inline constexpr int kGapLooks = 3;
std::string to_string(GapLook gaps);

/// What a person chooses about how a walkthrough is drawn.
struct WalkLook {
  MergePolicy policy = MergePolicy::positional;
  int merged = 3;
  bool fills = true;
  int filling = 16;  ///< WalkthroughOptions, where it fills
  GapLook gaps = GapLook::background;
  bool fades = true;  ///< WalkthroughOptions::Silhouettes::fade
  WalkthroughOptions::Show show = WalkthroughOptions::Show::picture;
  bool operator==(WalkLook const&) const = default;
};
WalkLook walk_look_of(WalkthroughOptions const& options);
/// `options` with this look. In false colour gaps are never interpolated.
WalkthroughOptions with_walk_look(WalkthroughOptions options, WalkLook const& look);
/// The commands that change a look, and what there is to say about it; nothing for others.
std::optional<std::string> change_walk_look(WalkLook& look, Command command);

/// Makes what nothing was drawn on magenta, opaque, where gaps are to look so.
void paint_gaps(cv::Mat4b& picture, GapLook gaps);

}  // namespace scanview
