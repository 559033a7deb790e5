#pragma once
#include <cstdint>
#include <functional>
#include <vector>

#include "acquire/scan_set.h"

namespace scanview::scene {

/// A surface f(p) = 0, negative inside, whose value changes by at most `slope` a unit; and a colour for every point.
struct Solid {
  std::function<double(Eigen::Vector3d const&)> f;
  double slope = 1;
  std::function<Eigen::Vector3d(Eigen::Vector3d const&)> color;  ///< B, G, R in 0..255; none: no colour
};

/// A sphere of radius 1 with hollows and bumps that no rotation maps onto itself.
Solid blob();
/// The unit sphere, plain.
Solid sphere();
/// The half space z > 0 seen from below, with or without a printed pattern.
Solid plane();
/// A cylinder of radius 1 without ends about an axis through the origin.
Solid cylinder(Eigen::Vector3d const& axis);
/// The half space z > 0 with a thin sheet before one half of it, seen from below: two parallel planes, and no wall
/// between them.
Solid parallel_planes();
/// Three planes at right angles that meet in the origin, seen from below into the corner, each at the same slant.
Solid corner();
/// A box of half sides 0.7, 0.5, 0.9 with a printed pattern.
Solid printed_box();
/// A pattern of soft dots of three sizes.
Eigen::Vector3d print(Eigen::Vector3d const& p);

struct Noise {
  double depth = 0;    ///< standard deviation, units
  double color = 0;    ///< 8-bit steps
  double missing = 0;  ///< share of the depths that are lost
  std::uint64_t seed = 1;
};

/// What a camera sees of a solid, by sphere tracing: no rasteriser of ours is involved. Depths beyond `far` are none.
RangeImage capture(Solid const& solid, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                   Noise const& noise, double far = 8);

/// Where a camera at `eye` stands that looks at the origin, y down.
Eigen::Isometry3d look_at_origin(Eigen::Vector3d const& eye);

/// `count` views on a ring of radius 4 at height `height`, 160 x 160 pixels, names "000"...; object_from_camera is
/// true.
ScanSet ring(Solid const& solid, int count, double height, Noise const& noise, bool orthographic = false);

/// Two views, "000" and "001", of 120 x 120 pixels from nearby, straight on; object_from_camera is true.
ScanSet two_views(Solid const& solid, Noise noise);

/// Every pose but the first turned by `degrees` about a random axis through the origin and moved by `length`.
std::vector<Eigen::Isometry3d> disturbed(std::vector<Eigen::Isometry3d> const& poses, double degrees, double length,
                                         std::uint64_t seed);
std::vector<Eigen::Isometry3d> poses_of(ScanSet const& set);
void set_poses(ScanSet& set, std::vector<Eigen::Isometry3d> const& poses);

}  // namespace scanview::scene
