#pragma once
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "acquire/scan_set.h"

namespace scanview {

/// What is seen from one point: range images that share an eye, of any fields of view. Their poses are
/// scene_from_camera, and agree in where the eye is. Where an image has the class `background`, nothing is nearer than
/// the sky: its colour is that of infinite distance.
struct CapturedNode {
  std::string name;  ///< "000"
  Eigen::Vector3d position{0, 0, 0};
  std::vector<View> sides;  ///< at least one
  /// Throws std::logic_error where the above does not hold.
  void check() const;
};

/// The same in pictures of half the size (rounded down, at least one pixel): colours are means in linear light, depths
/// means in 1 / z of those of four pixels that belong to the nearest's surface, which is taken to be within a fiftieth
/// of its depth.
CapturedNode half_resolution(CapturedNode const& node);

/// The sides of a cube about a point, its edges parallel to the scene's axes (Greene 1986; Darsa 1998, §4.1): each
/// picture is square and 90 degrees wide, the outer edges of its outermost pixels on the edges of the cube.
inline constexpr int kCubeSides = 6;
std::string cube_side_name(int side);  ///< "px", "nx", "py", "ny", "pz", "nz": the axis it looks along
Camera cube_side_camera(int size);
/// Where the side looks along ± x or ± z, the picture's upper side is towards + y.
Eigen::Isometry3d scene_from_cube_side(int side, Eigen::Vector3d const& position);

}  // namespace scanview
