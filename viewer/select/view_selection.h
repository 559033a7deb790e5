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

/// A view that is drawn: `weight` is its share in the mixture (ViewSphere; 0 for a view that only fills), `fill` how
/// much it counts where the views with weight have no good sample.
struct UsedView {
  std::size_t view = 0;
  double weight = 0;
  double fill = 0;
};

/// Adds the `3 + fill_views` views nearest to the eye as views that fill: fill = 1 − angle / angle of the nearest view
/// left out. It reaches zero where a view leaves the nearest, so nothing pops. `directions` are those the sphere was
/// made of. fill_views = 0: `main` as it is, with no fill. Ordered by view.
std::vector<UsedView> add_fill_views(std::vector<ViewWeight> const& main,
                                     std::vector<Eigen::Vector3d> const& directions, Eigen::Vector3d const& eye,
                                     int fill_views);

/// Median angle between a direction and its nearest neighbour, radians; π where there is one direction only. Closer
/// ones, coinciding ones say, count as 0.05 apart.
double median_spacing(std::vector<Eigen::Vector3d> const& directions);

/// How much `fill` counts where it is decided what hides what: fully where the eye is between views, hardly where it is
/// at one, which has seen itself what is nearest there.
double fill_rank(std::vector<UsedView> const& views);

}  // namespace scanview
