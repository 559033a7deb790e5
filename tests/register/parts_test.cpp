#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/random.h"
#include "range_scene.h"
#include "register/feature_match.h"
#include "register/pair_form.h"
#include "register/pairwise_icp.h"
#include "register/view_graph.h"

namespace scanview {
namespace {

using scene::Noise;

Vector6d small_twist(double size, std::uint64_t seed) {
  CounterRandom random(seed, 0);
  Vector6d twist;
  for (int k = 0; k < 6; ++k) twist[k] = size * (2 * random.uniform() - 1);
  return twist;
}

TEST(Motion, TwistAndMotionAreInverse) {
  Eigen::Vector3d const center(0.3, -0.2, 4);
  for (std::uint64_t seed = 1; seed < 20; ++seed) {
    Vector6d const twist = small_twist(0.8, seed);
    EXPECT_LT((twist_of(motion(twist, center, 0.7), center, 0.7) - twist).norm(), 1e-12);
  }
}

TEST(PairForm, GradientIsThatOfTheCostItLinearises) {
  // Gauss-Newton from a motion off the truth must land near the truth: gradient, information, centre and signs of both
  // directions all take part. From 0.02 the error of second order is 0.02^2 times a curvature of a few.
  ScanSet const set = scene::ring(scene::blob(), 9, -1.0, Noise{});
  SurfacePyramid const a = build_pyramid(set.views[0].image), b = build_pyramid(set.views[1].image);
  Eigen::Isometry3d const truth = set.views[1].object_from_camera->inverse() * *set.views[0].object_from_camera;
  MatchOptions options;
  options.gate = 0.2;
  options.geometry_scale = 1e4;  // quadratic: sigma is 1e-5
  for (std::uint64_t seed = 1; seed < 6; ++seed) {
    Eigen::Vector3d const center = (truth * a.centroid + b.centroid) / 2;
    Vector6d const off = small_twist(0.02, seed);
    PairForm const form =
        match_pair(a.levels[0], b.levels[0], motion(off, center, 1) * truth, a.centroid, b.centroid, options);
    Vector6d const step = -form.information.ldlt().solve(form.gradient);
    Eigen::Isometry3d const landed = motion(step, form.center, 1) * motion(off, center, 1) * truth;
    EXPECT_LT(twist_of(landed * truth.inverse(), center, 1).norm(), 0.25 * off.norm()) << seed;
    EXPECT_EQ(form.held, 0);
  }
}

TEST(PairForm, ToneAloneHoldsAPlane) {
  scene::Solid printed = scene::plane();
  printed.color = scene::print;
  Camera const camera = Camera::perspective(120, 120, 200, 200, 59.5, 59.5);
  Eigen::Isometry3d const pose = scene::look_at_origin({0, 0, -4});
  // Each view with its own noise: the same noise twice would hold the plane by itself.
  SurfacePyramid const view = build_pyramid(scene::capture(printed, camera, pose, Noise{0.001, 1, 0, 2}));
  SurfacePyramid const other = build_pyramid(scene::capture(printed, camera, pose, Noise{0.001, 1, 0, 3}));
  MatchOptions options;
  options.gate = 0.1;
  Vector6d off = Vector6d::Zero();
  off[3] = 0.01;  // half a pixel
  options.use = MatchOptions::Use::shape;
  EXPECT_EQ(
      match_pair(view.levels[0], other.levels[0], motion(off, view.centroid, 1), view.centroid, view.centroid, options)
          .held,
      3);
  options.use = MatchOptions::Use::shape_and_tone;
  PairForm const form =
      match_pair(view.levels[0], other.levels[0], motion(off, view.centroid, 1), view.centroid, view.centroid, options);
  EXPECT_EQ(form.held, 0);
  Vector6d const step = -form.information.ldlt().solve(form.gradient);
  EXPECT_NEAR(step[3], -0.01, 0.002);
}

TEST(ViewSurface, FitsPlanesExactlyAndLeavesOutlinesOut) {
  // A slanted plane is linear in inverse depth: the fit has no error but that of float depths.
  Camera const camera = Camera::perspective(80, 60, 100, 110, 40, 30);
  RangeImage image = empty_range_image(camera);
  Eigen::Vector3d const normal = Eigen::Vector3d(0.3, -0.2, -1).normalized();
  for (int y = 10; y < 50; ++y)
    for (int x = 10; x < 70; ++x) {
      Eigen::Vector3d const ray = camera.ray_direction(x, y);
      image.depth(y, x) = static_cast<float>(normal.dot(Eigen::Vector3d(0, 0, 2)) / normal.dot(ray));
      image.sigma(y, x) = 1e-4f;
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
    }
  SurfacePyramid const pyramid = build_pyramid(image);
  ViewSurface const& surface = pyramid.levels[0];
  EXPECT_FALSE(surface.has_surface(30, 10));
  for (SurfaceSample const& sample : surface.samples) {
    EXPECT_LT((sample.normal - normal).norm(), 1e-4);
    EXPECT_NEAR(normal.dot(sample.point), normal.dot(Eigen::Vector3d(0, 0, 2)), 1e-6);
  }
  EXPECT_GT(surface.samples.size(), 50u * 30u);
}

TEST(PairwiseIcp, BringsFifteenDegreesHome) {
  ScanSet const set = scene::ring(scene::blob(), 9, -1.0, Noise{0.002, 0, 0, 4});
  SurfacePyramid const a = build_pyramid(set.views[0].image), b = build_pyramid(set.views[1].image);
  Eigen::Isometry3d const truth = set.views[1].object_from_camera->inverse() * *set.views[0].object_from_camera;
  Vector6d off = Vector6d::Zero();
  off[1] = 15 * 3.14159265 / 180;
  IcpResult const got = pairwise_icp(a.levels[1], b.levels[1], motion(off, b.centroid, 1) * truth, {});
  EXPECT_LT(twist_of(got.b_from_a * truth.inverse(), b.centroid, 1).norm(), 0.02);
}

TEST(ViewGraph, PartsAreOrderedBySizeThenByFirstView) {
  auto const parts = connected_parts(6, {{4, 5, 1, 1}, {1, 2, 1, 1}, {2, 3, 1, 1}});
  EXPECT_EQ(parts, (std::vector<std::vector<std::size_t>>{{1, 2, 3}, {4, 5}, {0}}));
}

TEST(ViewGraph, StrongestEdgesStayConnected) {
  // Two groups of three, joined by one weak edge.
  std::vector<ViewGraphEdge> const edges{{0, 1, 0.9, 0.9}, {0, 2, 0.8, 0.8}, {1, 2, 0.2, 0.2}, {2, 3, 0.1, 0.1},
                                         {3, 4, 0.9, 0.9}, {3, 5, 0.8, 0.8}, {4, 5, 0.7, 0.7}};
  std::vector<ViewGraphEdge> const kept = strongest_edges(6, edges, 1);
  EXPECT_EQ(connected_parts(6, kept).size(), 1u);
  EXPECT_EQ(kept.size(), 5u);  // 1-2 and 4-5 say nothing new
}

TEST(FeatureMatch, FindsTheMotionOfAPrintedBox) {
  ScanSet const set = scene::ring(scene::printed_box(), 12, -1.0, Noise{0.003, 2, 0, 4});
  auto const features = [&](std::size_t i) {
    return find_features(set.views[i].image, build_pyramid(set.views[i].image).levels[0]);
  };
  FeatureMotionOptions options;
  options.threshold = 0.03;
  FeatureMotion const got = match_features(features(0), features(1), options);
  ASSERT_TRUE(got.found) << got.matches << " matches, " << got.inliers << " inliers";
  Eigen::Isometry3d const truth = set.views[1].object_from_camera->inverse() * *set.views[0].object_from_camera;
  EXPECT_LT(twist_of(got.b_from_a * truth.inverse(), {0, 0, 4}, 1).norm(), 0.06);
}

TEST(FeatureMatch, FitMotionIsExactOnExactPoints) {
  Eigen::Isometry3d const truth = motion(small_twist(0.9, 3), {0, 1, 0}, 1);
  std::vector<Eigen::Vector3d> from{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0.3, 0.2, 0}}, to;
  for (auto const& p : from) to.push_back(truth * p);
  EXPECT_LT((fit_motion(from, to).matrix() - truth.matrix()).norm(), 1e-12);  // a plane of points: no mirror image
}

}  // namespace
}  // namespace scanview
