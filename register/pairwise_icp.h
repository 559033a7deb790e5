#pragma once
#include "register/pair_form.h"

namespace scanview {

struct IcpOptions {
  double radius = 1;            ///< of the object: scales rotations, units
  double first_distance = 0.3;  ///< furthest correspondence at the start, in radii
  double last_distance = 0.03;  ///< and at the end
  int iterations = 25;
  std::size_t max_samples = 2500;
};

struct IcpResult {
  Eigen::Isometry3d b_from_a = Eigen::Isometry3d::Identity();
  /// Mean over the correspondences, without unit: how well the surfaces hold each motion of a in b's frame (rotations
  /// about `center`, scaled by the radius). Motions that only noise constrains are zero.
  Matrix6d information = Matrix6d::Zero();
  Eigen::Vector3d center{0, 0, 0};
  std::size_t matches = 0;  ///< at the end; 0: nothing overlapped, b_from_a is the start
};

/// Point-to-plane ICP (Chen and Medioni 1991) of two views by nearest points, which bears larger errors at the start
/// than projection does. Correspondences and their rejection (distance, normals, boundaries) are PCL's; the step is
/// solved here with unconstrained motions held, since PCL's own solver inverts a singular matrix on planes.
IcpResult pairwise_icp(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a,
                       IcpOptions const& options);

}  // namespace scanview
