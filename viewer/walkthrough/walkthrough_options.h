#pragma once
#include <array>
#include <string>

#include "viewer/walkthrough/raster_node.h"

namespace scanview {

/// How the pictures of the nodes around the eye become one (Darsa 1998, §6). layering: in each pixel the nearest sample
/// shows. binary: of samples of one surface the one of the better triangle. weighted: their mean, weighted by quality.
/// positional: and by how near the eye is to each node.
enum class MergePolicy { layering, binary, weighted, positional };
inline constexpr std::array kMergePolicies = {MergePolicy::layering, MergePolicy::binary, MergePolicy::weighted,
                                              MergePolicy::positional};
std::string to_string(MergePolicy policy);

/// Pixels that no node shows. background: nothing is drawn. interpolated: the farther of the colours around them, drawn
/// out over them, "an interpolation is just a crude approximation that is acceptable for very small gaps" (§5).
enum class VisibilityGaps { background, interpolated };

struct WalkthroughOptions {
  MergePolicy policy = MergePolicy::positional;
  /// Nodes that are merged: those nearest to the eye. Node i of n weighs 1/dᵢ − 1/dₙ₊₁, dₙ₊₁ the distance of the next
  /// node: with two nodes and no third the paper's t, and no node comes or goes with a jump (positional; the other
  /// policies do not weigh, and jump).
  int merged = 3;
  /// Further nodes, the nearest first, that are drawn only where nothing is yet (§8: a mask, and the frustum narrowed
  /// to the gaps), as long as there are gaps.
  int filling = 16;
  VisibilityGaps gaps = VisibilityGaps::background;
  NodeQuality quality = NodeQuality::density;
  /// Whether a sample's distance from the silhouettes of its node counts too: texels at a silhouette hold a mixture of
  /// what is on both its sides.
  enum class Silhouettes { fade, keep } silhouettes = Silhouettes::fade;
  /// How a picture comes about, in false colour (view_hue() of a node's index). sources: in each pixel that of the node
  /// that counts most there. triangles: over the picture, the edges of each node's triangles in its own.
  enum class Show { picture, sources, triangles } show = Show::picture;
  /// δ: samples of one surface may differ by this share of their depth, and beyond that by so many pixels of parallax
  /// at the nodes' walking radius.
  double depth_tolerance = 0.01;
  double parallax_tolerance_px = 1;
  void validate() const;
};

}  // namespace scanview
