// Our parts inside PCL's registration, and PCL's inside ours.
#include "register/pcl_parts.h"

#include <gtest/gtest.h>
#include <pcl/registration/icp.h>
#include <pcl/registration/transformation_estimation_point_to_plane_lls.h>

#include <cmath>

#include "range_scene.h"
#include "register/pairwise_icp.h"

namespace scanview {
namespace {

using scene::Noise;
using PlaneLls = pcl::registration::TransformationEstimationPointToPlaneLLS<pcl::PointNormal, pcl::PointNormal>;

struct Pair {
  SurfacePyramid a, b;
  Eigen::Isometry3d truth, start;

  double error(Eigen::Isometry3d const& b_from_a) const {
    return twist_of(b_from_a * truth.inverse(), b.centroid, 1).norm();
  }
};

Pair pair_of(scene::Solid const& solid, double off_deg, double unit = 1) {
  ScanSet set = scene::ring(solid, 9, -1.0, Noise{0.002, 0, 0, 4});
  set.views.resize(2);
  for (View& view : set.views) {
    view.image.depth *= unit;
    view.image.sigma *= unit;
    view.object_from_camera->translation() *= unit;
  }
  Pair pair{build_pyramid(set.views[0].image),
            build_pyramid(set.views[1].image),
            set.views[1].object_from_camera->inverse() * *set.views[0].object_from_camera,
            {}};
  Vector6d off = Vector6d::Zero();
  off[1] = off_deg * 3.14159265 / 180;
  off[3] = off[1] / 3;
  pair.start = motion(off * unit, pair.b.centroid, unit) * pair.truth;
  return pair;
}

// pcl::IterativeClosestPoint with our projection and rejection, and the estimation given.
Eigen::Isometry3d align_by_pcl(
    Pair const& pair, double radius,
    pcl::registration::TransformationEstimation<pcl::PointNormal, pcl::PointNormal>::Ptr const& estimation) {
  ViewSurface const &a = pair.a.levels[0], &b = pair.b.levels[0];
  PclFrame const frame = pcl_frame_of(b, radius);
  PclView const source = make_pcl_view(a, pair.start, frame, 4000);
  PclView const target = make_pcl_view(b, Eigen::Isometry3d::Identity(), frame, 100000);
  pcl::IterativeClosestPoint<pcl::PointNormal, pcl::PointNormal> icp;
  icp.setInputSource(source.cloud);
  icp.setInputTarget(target.cloud);
  icp.setCorrespondenceEstimation(std::make_shared<ProjectiveCorrespondence>(b, frame));
  icp.addCorrespondenceRejector(std::make_shared<OutlineRejector>(target.at_outline));
  icp.setTransformationEstimation(estimation);
  icp.setMaxCorrespondenceDistance(0.15);
  icp.setMaximumIterations(40);
  icp.setTransformationEpsilon(1e-12);
  PclCloud aligned;
  icp.align(aligned);
  return frame.camera_motion(icp.getFinalTransformation()) * pair.start;
}

TEST(PclParts, OursConvergeInsidePclsIterativeClosestPoint) {
  Pair const pair = pair_of(scene::blob(), 5);
  EXPECT_LT(pair.error(align_by_pcl(pair, 1, std::make_shared<SigmaWeightedPlaneEstimation>())), 0.003);
}

TEST(PclParts, PclsEstimationConvergesOnOurCorrespondences) {
  Pair const pair = pair_of(scene::blob(), 5);
  EXPECT_LT(pair.error(align_by_pcl(pair, 1, std::make_shared<PlaneLls>())), 0.01);
}

TEST(PclParts, EveryPartCanBeSwappedInOurs) {
  Pair const pair = pair_of(scene::blob(), 5);
  ViewSurface const &a = pair.a.levels[1], &b = pair.b.levels[1];
  for (bool const projective : {false, true})
    for (bool const pcls : {false, true}) {
      IcpOptions options;
      if (projective)
        options.correspondences = std::make_shared<ProjectiveCorrespondence>(b, pcl_frame_of(b, options.radius));
      if (pcls) options.estimation = std::make_shared<PlaneLls>();
      IcpResult const got = pairwise_icp(a, b, pair.start, options);
      EXPECT_LT(pair.error(got.b_from_a), 0.01) << projective << pcls;
      EXPECT_GT(got.matches, 500u);
      EXPECT_GT(got.information.trace(), 1);
    }
}

TEST(PclParts, FloatsSufficeInAnyUnit) {
  Pair const pair = pair_of(scene::blob(), 5, 1e6);
  Eigen::Isometry3d const got = align_by_pcl(pair, 1e6, std::make_shared<SigmaWeightedPlaneEstimation>());
  EXPECT_LT(twist_of(got * pair.truth.inverse(), pair.b.centroid, 1e6).norm(), 0.003e6);
}

TEST(PclParts, WhatASphereDoesNotHoldStays) {
  Pair const pair = pair_of(scene::sphere(), 5);
  IcpResult const got = pairwise_icp(pair.a.levels[1], pair.b.levels[1], pair.start, {});
  Eigen::SelfAdjointEigenSolver<Matrix6d> const spectrum(got.information);
  for (int k = 0; k < 6; ++k) EXPECT_EQ(spectrum.eigenvalues()[k] > 1e-6, k >= 3) << k;
  // The centres lie on each other.
  Eigen::Vector3d const center_a(0, 0, std::hypot(4.0, 1.0));
  EXPECT_LT((got.b_from_a * center_a - center_a).norm(), 0.01);
}

TEST(PclParts, ReciprocalMatchesAreTheNearestOfEachTargetPoint) {
  Pair const pair = pair_of(scene::blob(), 5);
  ViewSurface const& b = pair.b.levels[0];
  PclFrame const frame = pcl_frame_of(b, 1);
  PclView const source = make_pcl_view(pair.a.levels[0], pair.start, frame, 100000);
  PclView const target = make_pcl_view(b, Eigen::Isometry3d::Identity(), frame, 1000);  // many fall on one
  ProjectiveCorrespondence matching(b, frame);
  matching.setInputSource(source.cloud);
  matching.setInputTarget(target.cloud);
  pcl::Correspondences all, one;
  matching.determineCorrespondences(all, 0.2);
  matching.determineReciprocalCorrespondences(one, 0.2);
  std::map<int, float> nearest;
  for (pcl::Correspondence const& c : all) {
    auto const [at, is_new] = nearest.emplace(c.index_match, c.distance);
    if (!is_new) at->second = std::min(at->second, c.distance);
    EXPECT_LE(c.distance, 0.2f * 0.2f);
  }
  EXPECT_GT(all.size(), 2 * one.size());
  EXPECT_EQ(one.size(), nearest.size());
  for (pcl::Correspondence const& c : one) EXPECT_EQ(c.distance, nearest.at(c.index_match));
}

TEST(PclParts, AMatchFallsOnThePixelOfItsPoint) {
  // Against itself every point finds itself.
  Pair const pair = pair_of(scene::blob(), 0);
  ViewSurface const& b = pair.b.levels[0];
  PclFrame const frame = pcl_frame_of(b, 1);
  PclView const view = make_pcl_view(b, Eigen::Isometry3d::Identity(), frame, 100000);
  ProjectiveCorrespondence matching(b, frame);
  matching.setInputSource(view.cloud);
  matching.setInputTarget(view.cloud);
  pcl::Correspondences found;
  matching.determineCorrespondences(found, 1e-3);
  EXPECT_GT(found.size(), view.cloud->size() * 9 / 10);
  for (pcl::Correspondence const& c : found) EXPECT_EQ(c.index_query, c.index_match);
}

TEST(PclParts, OutlinesAreRejected) {
  Pair const pair = pair_of(scene::blob(), 0);
  PclView const view =
      make_pcl_view(pair.b.levels[0], Eigen::Isometry3d::Identity(), pcl_frame_of(pair.b.levels[0], 1), 100000);
  pcl::Correspondences all, kept;
  for (int i = 0; i < static_cast<int>(view.cloud->size()); ++i) all.emplace_back(i, i, 0.0f);
  OutlineRejector(view.at_outline).getRemainingCorrespondences(all, kept);
  auto const outline = std::count(view.at_outline.begin(), view.at_outline.end(), true);
  EXPECT_GT(outline, 100);
  EXPECT_EQ(kept.size() + static_cast<std::size_t>(outline), all.size());
}

}  // namespace
}  // namespace scanview
