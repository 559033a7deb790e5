#include "register/pairwise_icp.h"

#include <pcl/registration/correspondence_rejection_median_distance.h>
#include <pcl/registration/correspondence_rejection_surface_normal.h>

#include <algorithm>
#include <cmath>

#include "register/pcl_parts.h"

namespace scanview {
namespace {

constexpr double kMinNormalCosine = 0.6;
constexpr double kMedianFactor = 3.0;
constexpr std::size_t kFewest = 20;  // points of a view, and matches

using NearestCorrespondence = pcl::registration::CorrespondenceEstimation<pcl::PointNormal, pcl::PointNormal>;

// Matches that neither outlines, normals nor distance speak against.
pcl::Correspondences reject(pcl::Correspondences const& found, PclView const& source, PclView const& target) {
  auto inside = std::make_shared<pcl::Correspondences>();
  OutlineRejector(target.at_outline).getRemainingCorrespondences(found, *inside);
  pcl::registration::CorrespondenceRejectorSurfaceNormal by_normal;
  by_normal.initializeDataContainer<pcl::PointNormal, pcl::PointNormal>();
  by_normal.setInputSource<pcl::PointNormal>(source.cloud);
  by_normal.setInputNormals<pcl::PointNormal, pcl::PointNormal>(source.cloud);
  by_normal.setInputTarget<pcl::PointNormal>(target.cloud);
  by_normal.setTargetNormals<pcl::PointNormal, pcl::PointNormal>(target.cloud);
  by_normal.setThreshold(kMinNormalCosine);
  by_normal.setInputCorrespondences(inside);
  pcl::Correspondences compatible, kept;
  by_normal.getCorrespondences(compatible);
  pcl::registration::CorrespondenceRejectorMedianDistance by_median;
  by_median.setMedianFactor(kMedianFactor);
  if (!compatible.empty()) by_median.getRemainingCorrespondences(compatible, kept);
  return kept;
}

}  // namespace

IcpResult pairwise_icp(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& start,
                       IcpOptions const& options) {
  IcpResult result;
  result.b_from_a = start;
  if (a.samples.size() < kFewest || b.samples.size() < kFewest || !(options.radius > 0)) return result;
  PclFrame const frame = pcl_frame_of(b, options.radius);
  result.center = frame.origin;
  PclView const target = make_pcl_view(b, Eigen::Isometry3d::Identity(), frame, options.max_samples);
  auto const own = std::make_shared<SigmaWeightedPlaneEstimation>();
  auto const estimation = options.estimation ? options.estimation : own;
  auto const matching = options.correspondences ? options.correspondences : std::make_shared<NearestCorrespondence>();
  matching->setInputTarget(target.cloud);

  for (int iteration = 0; iteration < options.iterations; ++iteration) {
    double const progress = std::min(1.0, iteration / (0.7 * options.iterations));
    double const reach = options.first_distance * std::pow(options.last_distance / options.first_distance, progress);
    PclView const source = make_pcl_view(a, result.b_from_a, frame, options.max_samples);
    pcl::Correspondences found;
    matching->setInputSource(source.cloud);
    matching->determineCorrespondences(found, reach);
    pcl::Correspondences const kept = reject(found, source, target);
    if (kept.size() < kFewest) break;
    result.matches = kept.size();
    result.information = own->step(*source.cloud, *target.cloud, kept).information;
    Eigen::Matrix4f step;
    estimation->estimateRigidTransformation(*source.cloud, *target.cloud, kept, step);
    if (!step.allFinite()) break;
    result.b_from_a = frame.camera_motion(step) * result.b_from_a;
    if (progress >= 1 && (step - Eigen::Matrix4f::Identity()).norm() < 1e-5f) break;
  }
  return result;
}

}  // namespace scanview
