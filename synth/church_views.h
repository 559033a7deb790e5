#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "calib/camera.h"

namespace scanview {

/// From where a picture of the church (church.h) is taken; `scene_from_camera` of a camera that looks along +z.
struct ChurchReference {
  Camera camera;
  Eigen::Isometry3d scene_from_camera;
};

inline constexpr int kChurchReferences = 36;

/// The first `count` of a fixed sequence of pictures, 512 x 512 pixels and 90 degrees, such that few already show most
/// of what somebody sees who walks along the nave to the east: views along the nave from several heights and sides
/// first, then what these hide, then aisles, vault, floor and the way back; the last two are taken outside, before the
/// open west end. Throws Error{usage} for a count outside 1 .. kChurchReferences.
std::vector<ChurchReference> church_references(int count);

/// Poses (scene_from_camera) of a walk along the nave to the east, looking about a little: even steps of the way, none
/// of them at a reference. Throws Error{usage} for a count below 2.
std::vector<Eigen::Isometry3d> church_path(int count = 40);

}  // namespace scanview
