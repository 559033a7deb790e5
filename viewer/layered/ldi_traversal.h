#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "calib/camera.h"
#include "viewer/layered/ldi_tree.h"

namespace scanview {

/// A cell that a picture is drawn from.
struct TraversedCell {
  std::int32_t cell = 0;
  /// Its children are drawn too, and of its own pixels only those that are not filtered (Chang 1998, §3.2, step 5).
  bool descended = false;
  /// The cell is coarser than it should be; its children are left for later (traverse(), `until`).
  bool postponed = false;
  float stamp_px = 0;  ///< the greatest that a grid step of it may be on the screen; infinite where the eye is inside
  float distance = 0;  ///< of its middle along the camera's axis
};

struct TraversalOptions {
  /// Grid steps that are at most so large on the screen, in pixels, provide enough detail.
  double stamp_px = 1;
  /// Not 0: cells whose steps are at most so large are drawn although their children provide more; they are postponed.
  double until_px = 0;
};

/// The cells that are to be drawn for a camera (§3.2): from the roots down, those outside the frustum left out; the
/// greatest size of a stamp is that at the nearest corner of the box; a cell in which the eye is never provides enough
/// detail. Nearest first.
std::vector<TraversedCell> traverse(LdiTree const& tree, Camera const& camera,
                                    Eigen::Isometry3d const& object_from_camera, TraversalOptions const& options);
/// Goes on below cells that were postponed: what is to be drawn in their place, but for their own unfiltered pixels,
/// which have been drawn.
std::vector<TraversedCell> traverse_below(LdiTree const& tree, std::vector<TraversedCell> const& postponed,
                                          Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                                          TraversalOptions const& options);

/// What is nearer to a perspective camera than this is not drawn: a few of the finest steps.
double nearest_drawn(LdiTree const& tree);

}  // namespace scanview
