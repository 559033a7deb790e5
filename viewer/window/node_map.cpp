#include "viewer/window/node_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

/// The largest of 1, 2, 5, 10, ... that is not greater.
double round_length(double most) {
  double const power = std::pow(10, std::floor(std::log10(most)));
  for (double const digit : {5.0, 2.0})
    if (digit * power <= most) return digit * power;
  return power;
}

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
  auto const on_ground = [&](Vector3d const& p) { return Vector2d(p.dot(ground.east), -p.dot(ground.north)); };
  std::vector<std::array<Vector3d, 2>> edges;
  if (box) edges = edges_of(*box);

  Eigen::AlignedBox2d extent(on_ground(control.eye()));
  for (Vector3d const& node : library.positions()) extent.extend(on_ground(node));
  for (auto const& edge : edges) extent.extend(on_ground(edge[0])).extend(on_ground(edge[1]));
  double const least = 2 * library.walking_radius();
  constexpr double kFilled = 0.88;
  double const scale = kFilled * std::min(1 / std::max(extent.sizes().x(), least),
                                          NodeMap::kHeight / std::max(extent.sizes().y(), least));
  Vector2d const middle = extent.center();
  auto const place = [&](Vector3d const& p) -> Vector2d {
    return scale * (on_ground(p) - middle) + Vector2d(0.5, 0.5 * NodeMap::kHeight);
  };

  NodeMap map;
  for (std::size_t i = 0; i < library.positions().size(); ++i)
    map.dots.push_back({i, place(library.positions()[i]), 0, false, library.has_failed(i)});
  for (UsedNode const& node : used) {
    map.dots[node.node].weight = node.weight;
    map.dots[node.node].drawn = true;
  }
  for (auto const& edge : edges) map.edges.push_back({place(edge[0]), place(edge[1])});
  map.eye = place(control.eye());
  constexpr double kViewLength = 0.13;
  for (int side = 0; side < 2; ++side) {
    double const angle = (control.heading_deg() + (side - 0.5) * width_deg) * std::numbers::pi / 180;
    map.view[side] = map.eye + kViewLength * Vector2d(std::sin(angle), -std::cos(angle));
  }
  constexpr double kLongestBar = 0.3;
  map.bar = round_length(kLongestBar / scale);
  map.bar_width = scale * map.bar;
  return map;
}

}  // namespace scanview
