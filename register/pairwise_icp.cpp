#include "register/pairwise_icp.h"

#include <pcl/point_cloud.h>
#include <pcl/point_types.h>
#include <pcl/registration/correspondence_estimation.h>
#include <pcl/registration/correspondence_rejection_median_distance.h>
#include <pcl/registration/correspondence_rejection_surface_normal.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace scanview {
namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;

constexpr double kMinNormalCosine = 0.6;
constexpr double kMedianFactor = 3.0;
constexpr double kFreeMotion = 2e-3;  // eigenvalue of the mean form below which noise could have made it

struct CloudWithEdges {
  Cloud::Ptr cloud{new Cloud};
  std::vector<bool> edge;
};

// A sample is at an edge where one of its neighbours on the grid of samples has no surface.
bool is_edge(ViewSurface const& surface, SurfaceSample const& sample, int pitch) {
  int const reach = std::max(2, pitch);
  for (auto const& [dx, dy] : {std::pair{-reach, 0}, {reach, 0}, {0, -reach}, {0, reach}}) {
    int const x = sample.x + dx, y = sample.y + dy;
    if (x < 0 || y < 0 || x >= surface.camera.width() || y >= surface.camera.height()) return true;
    if (!surface.has_surface(x, y)) return true;
  }
  return false;
}

// Coordinates about `origin` in radii, so that PCL's floats suffice whatever the unit.
CloudWithEdges make_cloud(ViewSurface const& surface, Eigen::Isometry3d const& pose, Eigen::Vector3d const& origin,
                          IcpOptions const& options) {
  CloudWithEdges result;
  SampleGrid const grid(surface, options.max_samples);
  for (SurfaceSample const& sample : surface.samples) {
    if (!grid.contains(sample)) continue;
    pcl::PointNormal point;
    point.getVector3fMap() = ((pose * sample.point - origin) / options.radius).cast<float>();
    point.getNormalVector3fMap() = (pose.linear() * sample.normal).cast<float>();
    result.cloud->push_back(point);
    result.edge.push_back(is_edge(surface, sample, grid.pitch()));
  }
  return result;
}

}  // namespace

IcpResult pairwise_icp(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& start,
                       IcpOptions const& options) {
  IcpResult result;
  result.b_from_a = start;
  if (a.samples.size() < 20 || b.samples.size() < 20 || !(options.radius > 0)) return result;
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  for (SurfaceSample const& sample : b.samples) origin += sample.point;
  origin /= static_cast<double>(b.samples.size());
  result.center = origin;
  CloudWithEdges const target = make_cloud(b, Eigen::Isometry3d::Identity(), origin, options);

  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    double const progress = std::min(1.0, iteration / (0.7 * options.iterations));
    double const reach = options.first_distance * std::pow(options.last_distance / options.first_distance, progress);
    CloudWithEdges const source = make_cloud(a, result.b_from_a, origin, options);

    pcl::registration::CorrespondenceEstimation<pcl::PointNormal, pcl::PointNormal> estimation;
    estimation.setInputSource(source.cloud);
    estimation.setInputTarget(target.cloud);
    auto found = std::make_shared<pcl::Correspondences>();
    estimation.determineCorrespondences(*found, reach);
    auto inside = std::make_shared<pcl::Correspondences>();
    for (pcl::Correspondence const& c : *found)
      if (!target.edge[static_cast<std::size_t>(c.index_match)]) inside->push_back(c);

    pcl::registration::CorrespondenceRejectorSurfaceNormal by_normal;
    by_normal.initializeDataContainer<pcl::PointNormal, pcl::PointNormal>();
    by_normal.setInputSource<pcl::PointNormal>(source.cloud);
    by_normal.setInputNormals<pcl::PointNormal, pcl::PointNormal>(source.cloud);
    by_normal.setInputTarget<pcl::PointNormal>(target.cloud);
    by_normal.setTargetNormals<pcl::PointNormal, pcl::PointNormal>(target.cloud);
    by_normal.setThreshold(kMinNormalCosine);
    by_normal.setInputCorrespondences(inside);
    pcl::Correspondences compatible;
    by_normal.getCorrespondences(compatible);

    pcl::registration::CorrespondenceRejectorMedianDistance by_median;
    by_median.setMedianFactor(kMedianFactor);
    pcl::Correspondences kept;
    if (!compatible.empty()) by_median.getRemainingCorrespondences(compatible, kept);
    if (kept.size() < 20) {
      if (iteration == 0) return result;
      break;
    }

    Matrix6d information = Matrix6d::Zero();
    Vector6d gradient = Vector6d::Zero();
    for (pcl::Correspondence const& c : kept) {
      auto const& from = (*source.cloud)[static_cast<std::size_t>(c.index_query)];
      auto const& to = (*target.cloud)[static_cast<std::size_t>(c.index_match)];
      Eigen::Vector3d const p = from.getVector3fMap().cast<double>(), n = to.getNormalVector3fMap().cast<double>();
      Vector6d row;
      row << p.cross(n), n;
      information += row * row.transpose();
      gradient += row * n.dot(p - to.getVector3fMap().cast<double>());
    }
    information /= static_cast<double>(kept.size());
    gradient /= static_cast<double>(kept.size());
    Eigen::SelfAdjointEigenSolver<Matrix6d> const spectrum(information);
    Vector6d step = Vector6d::Zero();
    result.information.setZero();
    for (int k = 0; k < 6; ++k) {
      if (spectrum.eigenvalues()[k] < kFreeMotion) continue;
      Vector6d const direction = spectrum.eigenvectors().col(k);
      step -= direction * (direction.dot(gradient) / spectrum.eigenvalues()[k]);
      result.information += spectrum.eigenvalues()[k] * direction * direction.transpose();
    }
    result.matches = kept.size();
    // In radii about the origin; back in units.
    result.b_from_a = motion(step * options.radius, origin, options.radius) * result.b_from_a;
    if (progress >= 1 && step.norm() < 1e-5) break;
  }
  return result;
}

}  // namespace scanview
