#include "viewer/window/tree_look.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace scanview {
namespace {

constexpr int kLooks = 3;  // of gaps, and of cells

template <typename Choice>
Choice next_of(Choice choice) {
  return static_cast<Choice>((static_cast<int>(choice) + 1) % kLooks);
}

}  // namespace

std::string to_string(TreeGaps gaps) {
  static char const* const names[kLooks] = {"filled from the levels above", "background", "magenta"};
  return names[static_cast<std::size_t>(gaps)];
}

std::string to_string(ShownCells cells) {
  static char const* const names[kLooks] = {"not shown", "those that are drawn",
                                            "those that are drawn, and above them"};
  return names[static_cast<std::size_t>(cells)];
}

TreeLook tree_look_of(LdiRenderOptions const& options) {
  TreeLook look;
  look.gaps = options.gaps == LdiRenderOptions::Gaps::filled ? TreeGaps::filled : TreeGaps::background;
  look.stamp_px = options.stamp_px;
  return look;
}

LdiRenderOptions with_tree_look(LdiRenderOptions options, TreeLook const& look) {
  using Gaps = LdiRenderOptions::Gaps;
  options.gaps = look.gaps == TreeGaps::filled ? Gaps::filled : Gaps::background;
  options.stamp_px = look.stamp_px;
  return options;
}

std::optional<std::string> change_tree_look(TreeLook& look, Command command) {
  switch (command) {
    case Command::next_gaps:
      look.gaps = next_of(look.gaps);
      return "gaps: " + to_string(look.gaps);
    case Command::next_cells:
      look.cells = next_of(look.cells);
      return "cells: " + to_string(look.cells);
    case Command::toggle_levels:
      look.levels = !look.levels;
      return look.levels ? "the level that each pixel comes from" : "";
    case Command::next_detail: {
      auto const next = std::upper_bound(std::begin(kStampSizes), std::end(kStampSizes), look.stamp_px);
      look.stamp_px = next == std::end(kStampSizes) ? kStampSizes[0] : *next;
      return fmt::format("detail: samples up to {:g} pixels wide", look.stamp_px);
    }
    default:
      return std::nullopt;
  }
}

void paint_gaps(cv::Mat4b& picture, double covered) {
  for (cv::Vec4b& pixel : picture)
    if (pixel[3] < 255 * covered) pixel = {255, 0, 255, 255};
}

}  // namespace scanview
