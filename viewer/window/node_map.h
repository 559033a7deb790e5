#pragma once
#include <Eigen/Geometry>
#include <array>
#include <optional>
#include <vector>

#include "viewer/walkthrough/walkthrough_renderer.h"
#include "viewer/window/ground_map.h"

namespace scanview {

/// A plan of a walkthrough's nodes: nodes, the box that can be walked in and the eye are all on it.
struct NodeMap : GroundMap {
  struct Dot {
    std::size_t node = 0;
    Eigen::Vector2d at{0, 0};
    double weight = 0;   ///< UsedNode
    bool drawn = false;  ///< with weight, or to fill
    bool failed = false;
  };
  std::vector<Dot> dots;
  std::vector<std::array<Eigen::Vector2d, 2>> edges;  ///< of the box

  /// The node whose dot is nearest to a place and within `reach` of it; dots.size() where there is none.
  std::size_t nearest(Eigen::Vector2d const& at, double reach) const;
};

/// width_deg: of the picture, seen from the eye. Linear in the nodes.
NodeMap node_map(NodeLibrary const& library, std::vector<UsedNode> const& used,
                 std::optional<Eigen::AlignedBox3d> const& box, WalkControl const& control, double width_deg);

}  // namespace scanview
