#pragma once
#include <Eigen/Geometry>

#include "base/random.h"
#include "synth/centered_model.h"

namespace scanview {

/// How far off the poses are that a set or a capture states.
struct Disturbance {
  double turn_deg = 0;  ///< about a random axis through the object's centre
  double share = 0;     ///< of the object's size (2 radii): moved by so much in a random direction
  /// Throws Error{usage} naming the field and its range.
  void validate() const;
};

/// `object_from_camera` as a stage would know it that is off by exactly so much.
Eigen::Isometry3d disturbed_pose(Eigen::Isometry3d const& object_from_camera, CenteredModel const& object,
                                 Disturbance const& disturbance, CounterRandom random);

}  // namespace scanview
