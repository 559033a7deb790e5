#include "viewer/window/node_map.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

std::vector<std::array<Vector3d, 2>> edges_of(Eigen::AlignedBox3d const& box) {
  std::vector<std::array<Vector3d, 2>> edges;
  using Corner = Eigen::AlignedBox3d::CornerType;
  for (int corner = 0; corner < 8; ++corner)
    for (int axis = 0; axis < 3; ++axis)
      if ((corner & (1 << axis)) == 0)
        edges.push_back({box.corner(static_cast<Corner>(corner)), box.corner(static_cast<Corner>(corner | 1 << axis))});
  return edges;
}

}  // namespace

std::size_t NodeMap::nearest(Vector2d const& at, double reach) const {
  std::size_t best = dots.size();
  for (Dot const& dot : dots) {
    double const distance = (dot.at - at).norm();
    if (distance > reach) continue;
    reach = distance;
    best = dot.node;
  }
  return best;
}

NodeMap node_map(NodeLibrary const& library, std::vector<UsedNode> const& used,
                 std::optional<Eigen::AlignedBox3d> const& box, WalkControl const& control, double width_deg) {
  Ground const& ground = control.ground();
  auto const on_ground = [&](Vector3d const& p) { return GroundPlan::on_ground(ground, p); };
  std::vector<std::array<Vector3d, 2>> edges;
  if (box) edges = edges_of(*box);

  Eigen::AlignedBox2d extent(on_ground(control.eye()));
  for (Vector3d const& node : library.positions()) extent.extend(on_ground(node));
  for (auto const& edge : edges) extent.extend(on_ground(edge[0])).extend(on_ground(edge[1]));
  GroundPlan const plan(ground, extent, 2 * library.walking_radius());

  NodeMap map;
  for (std::size_t i = 0; i < library.positions().size(); ++i)
    map.dots.push_back({i, plan.place(library.positions()[i]), 0, false, library.has_failed(i)});
  for (UsedNode const& node : used) {
    map.dots[node.node].weight = node.weight;
    map.dots[node.node].drawn = true;
  }
  for (auto const& edge : edges) map.edges.push_back({plan.place(edge[0]), plan.place(edge[1])});
  plan.add_eye_and_bar(map, control.eye(), control.heading_deg(), width_deg);
  return map;
}

}  // namespace scanview
