#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "acquire/scan_set.h"
#include "viewer/select/view_sphere.h"

namespace scanview {

/// Unit vector from `center` towards where a camera looks from: to its eye (perspective), or against its axis
/// (orthographic, whose eye is infinitely far away; also a perspective camera that stands at the centre itself).
Eigen::Vector3d direction_to_eye(Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                                 Eigen::Vector3d const& center);

/// Adds a faint weight to the `3 + fill_views` views nearest to the eye, so that they show where no main view has a
/// sample: kFaintWeight · (1 − angle / angle of the nearest view left out). It reaches zero where a view leaves the
/// nearest, so nothing pops. `directions` are those the sphere was made of. fill_views = 0: `main` as it is.
/// Ordered by view.
inline constexpr double kFaintWeight = 1e-3;
std::vector<ViewWeight> add_fill_views(std::vector<ViewWeight> const& main,
                                       std::vector<Eigen::Vector3d> const& directions, Eigen::Vector3d const& eye,
                                       int fill_views);

}  // namespace scanview
