#include "viewer/window/walk_look.h"

#include <fmt/format.h>

namespace scanview {
namespace {

using Show = WalkthroughOptions::Show;
using Silhouettes = WalkthroughOptions::Silhouettes;

template <typename Choice>
Choice next_of(Choice choice, int count) {
  return static_cast<Choice>((static_cast<int>(choice) + 1) % count);
}

}  // namespace

WalkLook walk_look_of(WalkthroughOptions const& options) {
  WalkLook look;
  look.policy = options.policy;
  look.merged = options.merged;
  look.fills = options.filling > 0;
  if (look.fills) look.filling = options.filling;
  look.gaps = options.gaps == VisibilityGaps::interpolated ? GapLook::interpolated : GapLook::background;
  look.fades = options.silhouettes == Silhouettes::fade;
  look.show = options.show;
  return look;
}

WalkthroughOptions with_walk_look(WalkthroughOptions options, WalkLook const& look) {
  options.policy = look.policy;
  options.merged = look.merged;
  options.filling = look.fills ? look.filling : 0;
  // False colours that run into gaps would say that nodes show what none does.
  bool const interpolates = look.gaps == GapLook::interpolated && look.show != Show::sources;
  options.gaps = interpolates ? VisibilityGaps::interpolated : VisibilityGaps::background;
  options.silhouettes = look.fades ? Silhouettes::fade : Silhouettes::keep;
  options.show = look.show;
  return options;
}

std::string to_string(GapLook gaps) {
  static char const* const names[] = {"background", "interpolated", "magenta"};
  return names[static_cast<std::size_t>(gaps)];
}

std::optional<std::string> change_walk_look(WalkLook& look, Command command) {
  auto const toggle = [&](Show show) { look.show = look.show == show ? Show::picture : show; };
  switch (command) {
    case Command::next_policy:
      look.policy = next_of(look.policy, static_cast<int>(kMergePolicies.size()));
      return "merging: " + to_string(look.policy);
    case Command::next_gaps:
      look.gaps = next_of(look.gaps, kGapLooks);
      return "gaps: " + to_string(look.gaps);
    case Command::toggle_filling:
      look.fills = !look.fills;
      return look.fills ? fmt::format("gaps are filled from {} further nodes", look.filling)
                        : "gaps are not filled from further nodes";
    case Command::toggle_sources:
      toggle(Show::sources);
      return look.show == Show::sources ? "which node each pixel comes from" : "";
    case Command::toggle_triangles:
      toggle(Show::triangles);
      return look.show == Show::triangles ? "each node's triangles" : "";
    default:
      return std::nullopt;
  }
}

void paint_gaps(cv::Mat4b& picture, GapLook gaps) {
  if (gaps != GapLook::magenta) return;
  for (cv::Vec4b& pixel : picture)
    if (pixel[3] == 0) pixel = {255, 0, 255, 255};
}

}  // namespace scanview
