#pragma once
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "viewer/layered/ldi_renderer.h"
#include "viewer/window/commands.h"

namespace scanview {

/// What is drawn where no pixel of the traversed cells is.
enum class TreeGaps {
  filled,      ///< LdiRenderOptions::Gaps::filled
  background,  ///< nothing
  magenta,     ///< nothing, to be seen
};
/// Which cells' boxes are drawn over the picture.
enum class ShownCells {
  none,
  drawn,      ///< those whose pixels are drawn, but for what they leave to their children
  traversed,  ///< faintly also those above them
};

/// What a person chooses about how a tree is drawn.
struct TreeLook {
  TreeGaps gaps = TreeGaps::filled;
  double stamp_px = 1;  ///< LdiRenderOptions
  ShownCells cells = ShownCells::none;
  bool levels = false;  ///< in the colours of the levels that pixels come from
  bool operator==(TreeLook const&) const = default;
};
std::string to_string(TreeGaps gaps);
std::string to_string(ShownCells cells);

TreeLook tree_look_of(LdiRenderOptions const& options);
LdiRenderOptions with_tree_look(LdiRenderOptions options, TreeLook const& look);
/// stamp_px that a person can choose from, finest first.
inline constexpr double kStampSizes[] = {0.7, 1, 1.4, 2, 4};
/// The commands that change a look, and what there is to say about it; nothing for others.
std::optional<std::string> change_tree_look(TreeLook& look, Command command);

/// Makes pixels magenta, opaque, that are covered less than `covered` (0 to 1): what is a gap to LdiRenderer.
void paint_gaps(cv::Mat4b& picture, double covered);

}  // namespace scanview
