#pragma once
#include <memory>

#include "register/pair_form.h"

namespace pcl {
struct PointNormal;
namespace registration {
template <typename Source, typename Target, typename Scalar>
class CorrespondenceEstimationBase;
template <typename Source, typename Target, typename Scalar>
class TransformationEstimation;
}  // namespace registration
}  // namespace pcl

namespace scanview {

struct IcpOptions {
  double radius = 1;            ///< of the object: scales rotations, units
  double first_distance = 0.3;  ///< furthest correspondence at the start, in radii
  double last_distance = 0.03;  ///< and at the end
  int iterations = 25;
  std::size_t max_samples = 2500;
  /// PCL's parts, of which any may stand here, or ours (pcl_parts.h); none: nearest points, and our
  /// SigmaWeightedPlaneEstimation. Clouds lie in `pcl_frame_of(b, radius)`. An estimation that finds no finite motion
  /// ends the iterations.
  std::shared_ptr<pcl::registration::CorrespondenceEstimationBase<pcl::PointNormal, pcl::PointNormal, float>>
      correspondences;
  std::shared_ptr<pcl::registration::TransformationEstimation<pcl::PointNormal, pcl::PointNormal, float>> estimation;
};

struct IcpResult {
  Eigen::Isometry3d b_from_a = Eigen::Isometry3d::Identity();
  /// Mean over the correspondences, without unit: how well the surfaces hold each motion of a in b's frame (rotations
  /// about `center`, scaled by the radius). Motions that only noise constrains are zero.
  Matrix6d information = Matrix6d::Zero();
  Eigen::Vector3d center{0, 0, 0};
  std::size_t matches = 0;  ///< at the end; 0: nothing overlapped, b_from_a is the start
};

/// Point-to-plane ICP (Chen and Medioni 1991) of two views in PCL's frame: correspondences (by default nearest points,
/// which bear larger errors at the start than projection does), their rejection (outlines, normals, median distance)
/// and the estimation of a motion, until it moves by less than 1e-5 radii.
IcpResult pairwise_icp(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a,
                       IcpOptions const& options);

}  // namespace scanview
