#pragma once
// Our parts for PCL's registration: they are used inside pcl::IterativeClosestPoint and beside PCL's own. Includes PCL.
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/correspondence_estimation.h>
#include <pcl/registration/correspondence_rejection.h>
#include <pcl/registration/transformation_estimation.h>

#include <memory>
#include <vector>

#include "register/pair_form.h"

namespace scanview {

using PclCloud = pcl::PointCloud<pcl::PointNormal>;

/// Where PCL's clouds lie: in radii about an origin in the target's camera frame, so that floats suffice whatever the
/// unit and however far the camera.
struct PclFrame {
  Eigen::Vector3d origin{0, 0, 0};  ///< target's camera coordinates, units
  double radius = 1;                ///< units

  Eigen::Vector3d camera_from_cloud(pcl::PointNormal const& p) const {
    return origin + radius * p.getVector3fMap().cast<double>();
  }
  /// A motion of a cloud, as PCL gives it, in the target's camera coordinates.
  Eigen::Isometry3d camera_motion(Eigen::Matrix4f const& motion_of_cloud) const;
};
/// About the mean of the samples. `target` must have samples.
PclFrame pcl_frame_of(ViewSurface const& target, double radius);

/// A view's samples for PCL: normals towards the camera, and in `curvature` the standard deviation of the point along
/// its normal, radii.
struct PclView {
  PclCloud::Ptr cloud{new PclCloud};
  std::vector<bool> at_outline;  ///< of every point: a neighbour on the grid of samples has no surface
};
PclView make_pcl_view(ViewSurface const& surface, Eigen::Isometry3d const& target_from_camera, PclFrame const& frame,
                      std::size_t max_samples);

/// Correspondences by projection into the target's camera (Blais and Levine 1995) in place of a search: a source point
/// matches the point of the target cloud at the pixel where it falls, or the nearest one on the grid of samples. The
/// target cloud must be of `surface`, in `frame`. No match where it falls outside or on no surface, or farther away
/// than the distance asked for. Cost: linear in the source's points.
class ProjectiveCorrespondence
    : public pcl::registration::CorrespondenceEstimationBase<pcl::PointNormal, pcl::PointNormal> {
 public:
  /// `surface` must outlive this.
  ProjectiveCorrespondence(ViewSurface const& surface, PclFrame const& frame);
  void determineCorrespondences(pcl::Correspondences& correspondences, double max_distance) override;
  /// Of the source points that match the same target point only the nearest.
  void determineReciprocalCorrespondences(pcl::Correspondences& correspondences, double max_distance) override;
  CorrespondenceEstimationBase::Ptr clone() const override { return std::make_shared<ProjectiveCorrespondence>(*this); }

 private:
  void index_target();
  int target_at(Eigen::Vector2d const& pixel) const;

  ViewSurface const* surface_;
  PclFrame frame_;
  cv::Mat1i index_;  // of the target's point at a pixel; -1
  int reach_ = 0;    // pixels from anywhere on the surface to its nearest point
};

/// Rejects matches of points at an outline or a step of the target: beyond it the source would still pull at its edge
/// (Turk and Levoy 1994). Normals are PCL's (CorrespondenceRejectorSurfaceNormal).
class OutlineRejector : public pcl::registration::CorrespondenceRejector {
 public:
  explicit OutlineRejector(std::vector<bool> target_at_outline);
  void getRemainingCorrespondences(pcl::Correspondences const& original, pcl::Correspondences& remaining) override;

 protected:
  void applyRejection(pcl::Correspondences& correspondences) override;

 private:
  std::vector<bool> target_at_outline_;
};

/// One Gauss-Newton step of point-to-plane (Chen and Medioni 1991), weighted by both points' sigma (`curvature`, see
/// PclView; 0 counts as float's rounding) and Tukey's loss, whose scale is the robust standard deviation of what comes
/// in. Motions that less than `kFreeMotion` of the mean form hold stay, where PCL's own solvers invert a singular
/// matrix.
class SigmaWeightedPlaneEstimation
    : public pcl::registration::TransformationEstimation<pcl::PointNormal, pcl::PointNormal> {
 public:
  static constexpr double kFreeMotion = 2e-3;  ///< eigenvalue of the mean form below which noise could have made it

  struct Step {
    Vector6d twist = Vector6d::Zero();  ///< rotation, then translation, about the cloud's origin
    /// Mean over the weights: how the surfaces hold each motion. Free ones are zero.
    Matrix6d information = Matrix6d::Zero();
  };
  Step step(PclCloud const& source, PclCloud const& target, pcl::Correspondences const& correspondences) const;

  void estimateRigidTransformation(PclCloud const& source, PclCloud const& target, Matrix4& motion) const override;
  void estimateRigidTransformation(PclCloud const& source, pcl::Indices const& of_source, PclCloud const& target,
                                   Matrix4& motion) const override;
  void estimateRigidTransformation(PclCloud const& source, pcl::Indices const& of_source, PclCloud const& target,
                                   pcl::Indices const& of_target, Matrix4& motion) const override;
  void estimateRigidTransformation(PclCloud const& source, PclCloud const& target,
                                   pcl::Correspondences const& correspondences, Matrix4& motion) const override;
};

}  // namespace scanview
