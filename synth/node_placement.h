#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/context.h"
#include "synth/group_cover.h"
#include "synth/scene_sight.h"

namespace scanview {

/// Where eyes may be, scene units; may be flat (one eye height), a line or a point. An eye may walk where it is in the
/// box, not inside an object, and at least the clearance from every surface.
struct WalkRegion {
  Eigen::AlignedBox3d box;
};

struct PlacementOptions {
  double clearance = 0;         ///< scene units; 0: 2 % of the radius of the scene
  double spacing = 0;           ///< of the test eyes, scene units; 0: such that some 450 may walk
  int directions = 1024;        ///< looked along from each test eye
  double greatest_gap = 0.002;  ///< the share of all directions from any eye that may stay unseen
  SceneWinding winding = SceneWinding::trusted;
  SightRules sight = {};          ///< sharp_from 0: a quarter of the region's diagonal
  std::size_t most_nodes = 1000;  ///< where they do not suffice, these leave the least
  int steps = 5000;               ///< exchanges tried to do with one node less
  /// Throws Error{usage} naming the field and its range.
  void validate() const;
};

struct Placement {
  std::vector<Eigen::Vector3d> nodes;  ///< places where an eye may walk
  /// Share of all directions that no node sees, mean and greatest over the test eyes: along directions that had no part
  /// in the choice.
  double uncovered_mean = 0, uncovered_worst = 0;
  std::size_t eyes = 0;  ///< test eyes; each was a candidate, too
  CoverEnd ended = CoverEnd::covered;
};

/// The fewest nodes that leave no gap above a given size wherever an eye may walk (Darsa, Costa, Varshney 1998, place
/// them by hand; the choice is a cover, as of guards: Gonzalez-Banos and Latombe 2001). Test eyes stand on a jittered
/// grid in the region and look around; a node is put where the most of what they see beyond the allowed gaps is seen by
/// the rules of `sight`, greedily, and exchanges then lower the number (group_cover.h). Any node may serve any eye.
///
/// Where eyes are cut off from each other (a closet) each part gets nodes of its own; so does the outside of a building
/// where the region holds some. Throws Error{bad_input} where no eye may walk, sees nothing, or there are too many for
/// 1 GB. The same nodes for any number of threads. Cost: eyes^2 * directions / 3 rays or so.
Placement place_nodes(TriangleMesh const& scene, WalkRegion const& region, PlacementOptions const& options,
                      Context& context);

/// Places where an eye may walk, on a jittered grid (see PlacementOptions). Throws Error{bad_input} where there is
/// none.
std::vector<Eigen::Vector3d> walkable_eyes(SceneSight const& scene, WalkRegion const& region,
                                           PlacementOptions const& options, Context& context);

/// A region for a scene that comes without one: its box (up is +y) less the clearance at the sides, at one height above
/// the floor: `eye_height`, or 45 % of the free height where there is none (1.6 m of 3.5 m). Over every place of a grid
/// of 64 x 64 the highest free space between a surface that faces up and the next one above, or the scene's top, is
/// found by rays; floor and free height are the medians of all. For a building of several floors, or a scene whose
/// outside may be walked in as well, a person gives a region instead. Throws Error{bad_input} where there is no floor,
/// or it is narrower than the clearance.
WalkRegion default_walk_region(TriangleMesh const& scene, PlacementOptions const& options = {},
                               std::optional<double> eye_height = std::nullopt);

}  // namespace scanview
