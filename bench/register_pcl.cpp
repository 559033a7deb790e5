#include "bench/register_pcl.h"

#include <pcl/features/normal_3d.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/gicp.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>

#include "bench/register_trials.h"

namespace scanview {
namespace {

using Point = pcl::PointNormal;
using Cloud = pcl::PointCloud<Point>;

Cloud::Ptr cloud_of(RangeImage const& image, Eigen::Isometry3d const& pose, bool with_normals) {
  Cloud::Ptr cloud(new Cloud);
  for (int y = 0; y < image.depth.rows; ++y)
    for (int x = 0; x < image.depth.cols; ++x) {
      if (!image.has_depth(x, y)) continue;
      Point point;
      point.getVector3fMap() = (pose * image.point(x, y)).cast<float>();
      cloud->push_back(point);
    }
  if (!with_normals) return cloud;
  pcl::NormalEstimation<Point, Point> normals;
  normals.setInputCloud(cloud);
  normals.setKSearch(10);
  normals.compute(*cloud);
  return cloud;
}

template <class Method>
Eigen::Isometry3d in_stages(Method& method, Cloud::Ptr const& a, Cloud::Ptr const& b, double size) {
  method.setInputSource(a);
  method.setInputTarget(b);
  method.setMaximumIterations(50);
  Eigen::Matrix4f pose = Eigen::Matrix4f::Identity();
  for (double const share : {0.1, 0.03, 0.008}) {
    method.setMaxCorrespondenceDistance(share * size);
    Cloud moved;
    method.align(moved, pose);
    pose = method.getFinalTransformation();
  }
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.matrix() = pose.cast<double>();
  result.linear() = Eigen::Quaterniond(result.linear()).normalized().toRotationMatrix();
  return result;
}

}  // namespace

Eigen::Isometry3d align_with_pcl(ScanSet const& set, Eigen::Isometry3d const& start, double size, PclMethod method) {
  bool const is_plane = method == PclMethod::plane;
  // PCL counts in floats: clouds lie about the origin, and a at its start.
  Eigen::Isometry3d const centred(Eigen::Translation3d(-centroid_of(set.views[1].image)));
  Cloud::Ptr const a = cloud_of(set.views[0].image, centred * start, is_plane),
                   b = cloud_of(set.views[1].image, centred, is_plane);
  Eigen::Isometry3d move;
  if (is_plane) {
    pcl::IterativeClosestPoint<Point, Point> icp;
    icp.setTransformationEstimation(
        std::make_shared<pcl::registration::TransformationEstimationPointToPlaneLLS<Point, Point>>());
    move = in_stages(icp, a, b, size);
  } else {
    pcl::GeneralizedIterativeClosestPoint<Point, Point> gicp;
    gicp.setCorrespondenceRandomness(10);
    move = in_stages(gicp, a, b, size);
  }
  return centred.inverse() * move * centred * start;
}

}  // namespace scanview
