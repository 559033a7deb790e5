#include "acquire/captured_node.h"

#include <stdexcept>

#include "base/error.h"

namespace scanview {

void CapturedNode::check() const {
  if (sides.empty()) throw std::logic_error("a node without sides");
  for (View const& side : sides) {
    side.image.check();
    if (!side.image.camera.is_perspective()) throw std::logic_error("a side of a node that is not perspective");
    if (!side.object_from_camera) throw std::logic_error("a side of a node without a pose");
    double const scale = 1 + position.norm();
    if ((side.eye() - position).norm() > 1e-9 * scale) throw std::logic_error("sides of a node with several eyes");
  }
}

std::string cube_side_name(int side) {
  static char const* const names[kCubeSides] = {"px", "nx", "py", "ny", "pz", "nz"};
  return names[side];
}

Camera cube_side_camera(int size) {
  if (size < 1) throw Error(ErrorCode::usage, {}, "the sides of a node must have at least one pixel");
  return Camera::perspective(size, size, 0.5 * size, 0.5 * size, 0.5 * (size - 1), 0.5 * (size - 1));
}

Eigen::Isometry3d scene_from_cube_side(int side, Eigen::Vector3d const& position) {
  double const sign = side % 2 == 0 ? 1 : -1;
  Eigen::Vector3d const forward = sign * Eigen::Vector3d::Unit(side / 2);
  Eigen::Vector3d const down =
      side / 2 == 1 ? Eigen::Vector3d(sign * Eigen::Vector3d::UnitZ()) : Eigen::Vector3d(-Eigen::Vector3d::UnitY());
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() << down.cross(forward), down, forward;
  pose.translation() = position;
  return pose;
}

}  // namespace scanview
