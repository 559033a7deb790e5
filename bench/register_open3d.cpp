#include "bench/register_open3d.h"

#include <open3d/geometry/KDTreeSearchParam.h>
#include <open3d/geometry/PointCloud.h>
#include <open3d/pipelines/registration/GlobalOptimization.h>
#include <open3d/pipelines/registration/GlobalOptimizationConvergenceCriteria.h>
#include <open3d/pipelines/registration/GlobalOptimizationMethod.h>
#include <open3d/pipelines/registration/PoseGraph.h>
#include <open3d/pipelines/registration/Registration.h>
#include <open3d/pipelines/registration/RobustKernel.h>
#include <open3d/pipelines/registration/TransformationEstimation.h>
#include <open3d/utility/Logging.h>

#include <array>
#include <memory>

namespace scanview {
namespace {

namespace o3d = open3d::pipelines::registration;
using open3d::geometry::PointCloud;

constexpr std::array kStages = {0.1, 0.03, 0.008};  // of the size
constexpr double kTukey = 0.003;                    // of the size: some four times the noise of the bench's sets
constexpr double kFewestInliers = 0.1;              // of a view's points within a stage's first distance

PointCloud cloud_of(RangeImage const& image) {
  PointCloud cloud;
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x)
      if (image.has_depth(x, y)) cloud.points_.push_back(image.point(x, y));
  cloud.EstimateNormals(open3d::geometry::KDTreeSearchParamKNN(10));
  cloud.OrientNormalsTowardsCameraLocation();
  return cloud;
}

Eigen::Matrix4d in_stages(PointCloud const& a, PointCloud const& b, Eigen::Matrix4d pose, double size) {
  o3d::TransformationEstimationPointToPlane const plane(std::make_shared<o3d::TukeyLoss>(kTukey * size));
  for (double const share : kStages)
    pose = o3d::RegistrationICP(a, b, share * size, pose, plane, o3d::ICPConvergenceCriteria(1e-7, 1e-7, 50))
               .transformation_;
  return pose;
}

Eigen::Isometry3d rigid(Eigen::Matrix4d const& matrix) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.matrix() = matrix;
  pose.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  return pose;
}

}  // namespace

Eigen::Isometry3d align_with_open3d(ScanSet const& set, Eigen::Isometry3d const& start, double size) {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  return rigid(in_stages(cloud_of(set.views[0].image), cloud_of(set.views[1].image), start.matrix(), size));
}

std::vector<Eigen::Isometry3d> multiway_with_open3d(ScanSet const& set, double size) {
  open3d::utility::SetVerbosityLevel(open3d::utility::VerbosityLevel::Error);
  std::vector<PointCloud> clouds;
  o3d::PoseGraph graph;
  for (View const& view : set.views) {
    clouds.push_back(cloud_of(view.image));
    graph.nodes_.emplace_back(view.object_from_camera->matrix());
  }
  double const finest = kStages.back() * size;
  for (std::size_t a = 0; a < clouds.size(); ++a)
    for (std::size_t b = a + 1; b < clouds.size(); ++b) {
      Eigen::Matrix4d const start =
          (set.views[b].object_from_camera->inverse() * *set.views[a].object_from_camera).matrix();
      if (o3d::EvaluateRegistration(clouds[a], clouds[b], 0.03 * size, start).fitness_ < kFewestInliers) continue;
      Eigen::Matrix4d const b_from_a = in_stages(clouds[a], clouds[b], start, size);
      graph.edges_.emplace_back(static_cast<int>(a), static_cast<int>(b), b_from_a,
                                o3d::GetInformationMatrixFromPointClouds(clouds[a], clouds[b], finest, b_from_a),
                                b != a + 1);
    }
  o3d::GlobalOptimization(graph, o3d::GlobalOptimizationLevenbergMarquardt(),
                          o3d::GlobalOptimizationConvergenceCriteria(),
                          o3d::GlobalOptimizationOption(finest, 0.25, 1.0, 0));
  std::vector<Eigen::Isometry3d> poses;
  for (auto const& node : graph.nodes_) poses.push_back(rigid(node.pose_));
  return poses;
}

}  // namespace scanview
