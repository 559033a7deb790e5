// Shapes that hold some motions and not others, and numbers at the ends of what doubles and floats bear.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <numbers>

#include "alignment_checks.h"
#include "range_scene.h"
#include "register/alignment.h"
#include "register/pair_form.h"

namespace scanview {
namespace {

using scene::Noise;
using ::testing::HasSubstr;

// The direction that ends a motion's words.
Eigen::Vector3d direction_in(std::string const& words) {
  Eigen::Vector3d d(0, 0, 0);
  EXPECT_EQ(std::sscanf(words.substr(words.find('(')).c_str(), "(%lf, %lf, %lf)", &d.x(), &d.y(), &d.z()), 3) << words;
  return d.normalized();
}

TEST(HardShapes, ACylinderTurnsAboutItsAxisAndSlidesAlongIt) {
  Eigen::Vector3d const axis = Eigen::Vector3d(0.3, 1, 0.2).normalized();
  ScanSet set = scene::two_views(scene::cylinder(axis), Noise{0.002, 0, 0, 3});
  auto const truth = scene::poses_of(set);
  auto const start = scene::disturbed(truth, 1, 0.02, 5);
  scene::set_poses(set, start);
  Context context;
  Alignment const got = align(set, {}, context);
  expect_finite(got);
  EXPECT_EQ(got.status, AlignmentStatus::converged);
  ASSERT_EQ(got.unobservable.size(), 2u) << ::testing::PrintToString(got.unobservable);
  EXPECT_THAT(got.unobservable,
              ::testing::UnorderedElementsAre(HasSubstr("001 may turn about"), HasSubstr("001 may slide along")));
  for (std::string const& words : got.unobservable) {
    // The words round to hundredths: a third of a degree.
    EXPECT_GT(std::abs(direction_in(words).dot(axis)), std::cos(2 * kDegree)) << words;
    EXPECT_THAT(context.warnings(), ::testing::Contains(HasSubstr(words)));
  }
  // What the surface holds is recovered: the axis lies on itself. Half the views' 10^4 depths give a standard deviation
  // of 0.002 sqrt(2) / 70 for an offset, and about as many radians for a tilt; five of them.
  Eigen::Isometry3d const off = got.object_from_camera[1] * truth[1].inverse();
  double const bound = 5 * 0.002 * std::sqrt(2.0) / 70;
  EXPECT_LT((off.linear() * axis).cross(axis).norm(), bound);
  EXPECT_LT((off.translation() - axis.dot(off.translation()) * axis).norm(), bound);
  // What it does not hold stays as it was: the way from the start, at the view's centroid, has no part along the axis,
  // nor along a turn about it; but for products of the start's two errors (0.02 each).
  SurfacePyramid const view = build_pyramid(set.views[1].image);
  Eigen::Vector3d const centroid = start[1] * view.centroid;
  Vector6d slide, turn;
  slide << Eigen::Vector3d::Zero(), axis;
  turn << axis * view.radius, axis.cross(centroid);
  Vector6d const way = twist_of(got.object_from_camera[1] * start[1].inverse(), centroid, view.radius);
  EXPECT_NEAR(way.dot(slide), 0, 1e-3);
  EXPECT_NEAR(way.dot(turn.normalized()), 0, 1e-3);
}

TEST(HardShapes, TwoParallelPlanesHoldNoMoreThanOne) {
  ScanSet set = scene::two_views(scene::parallel_planes(), Noise{0.002, 0, 0, 3});
  auto const truth = scene::poses_of(set);
  auto const start = scene::disturbed(truth, 0.5, 0.02, 5);
  scene::set_poses(set, start);
  Context context;
  Alignment const got = align(set, {}, context);
  expect_finite(got);
  EXPECT_EQ(got.status, AlignmentStatus::converged);
  ASSERT_EQ(got.unobservable.size(), 3u) << ::testing::PrintToString(got.unobservable);
  EXPECT_THAT(got.unobservable, ::testing::Contains(HasSubstr("turn about")).Times(1));
  EXPECT_THAT(got.unobservable, ::testing::Contains(HasSubstr("slide along")).Times(2));
  for (std::string const& words : got.unobservable)
    EXPECT_NEAR(std::abs(direction_in(words).z()), words.find("turn") != std::string::npos ? 1 : 0, 0.05) << words;
  Eigen::Isometry3d const off = got.object_from_camera[1] * truth[1].inverse();
  Eigen::Isometry3d const before = start[1] * truth[1].inverse();
  double const bound = 5 * 0.002 * std::sqrt(2.0) / 70;  // as of the cylinder
  EXPECT_NEAR(off.translation().z(), 0, bound);
  EXPECT_NEAR((off.linear() * Eigen::Vector3d::UnitZ()).cross(Eigen::Vector3d::UnitZ()).norm(), 0, bound);
  EXPECT_LT((off.translation() - before.translation()).head<2>().norm(), 1e-3);
}

TEST(HardShapes, ACornerOfThreePlanesHoldsEverything) {
  double const sigma = 0.002;
  ScanSet set = scene::two_views(scene::corner(), Noise{sigma, 0, 0, 3});
  auto const truth = scene::poses_of(set);
  scene::set_poses(set, scene::disturbed(truth, 3, 0.04, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  expect_finite(got);
  EXPECT_EQ(got.status, AlignmentStatus::converged);
  EXPECT_TRUE(got.unobservable.empty()) << ::testing::PrintToString(got.unobservable);
  EXPECT_TRUE(context.warnings().empty()) << ::testing::PrintToString(context.warnings());
  // A third of the depths lie on each plane, at a slant of cosine 1/sqrt(3), four fifths of them in both views, and
  // both views have noise: the plane's offset is known to sigma / sqrt(3) * sqrt(2 / n). A motion at the corner is the
  // three offsets together. A plane's points are about 0.6 from its middle either way, and its tilt is known to the
  // offset's deviation over that; a rotation about each of three axes is held by two planes. Four deviations of either.
  double const n = 0.8 / 3 * cv::countNonZero(set.views[0].image.depth == set.views[0].image.depth);
  double const offset = sigma / std::sqrt(3.0) * std::sqrt(2 / n);
  PoseComparison const error = compare_poses(set, got.object_from_camera, truth);
  EXPECT_LT(error.max_length, 4 * std::sqrt(3.0) * offset);
  EXPECT_LT(error.max_deg * kDegree, 4 * std::sqrt(3.0 / 2) * offset / 0.6);
  // And the report knows it.
  EXPECT_LT(error.max_length, 4 * got.poses[1].std_length);
  EXPECT_LT(got.poses[1].std_length, 3 * std::sqrt(3.0) * offset);
}

TEST(HardShapes, NoNoiseAndNoSigmaIsExactOnPlanes) {
  // Orthographic views interpolate a plane without error, so that nothing but the rounding of depths remains.
  ScanSet set = scene::two_views(scene::corner(), Noise{});
  Camera const camera = Camera::orthographic(120, 120, 0.02, 0.02, 59.5, 59.5);
  for (View& view : set.views) {
    view.image = scene::capture(scene::corner(), camera, *view.object_from_camera, Noise{});
    view.image.sigma.setTo(0, view.image.sigma == view.image.sigma);
  }
  auto const truth = scene::poses_of(set);
  scene::set_poses(set, scene::disturbed(truth, 3, 0.04, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  expect_finite(got);
  EXPECT_EQ(got.status, AlignmentStatus::converged);
  EXPECT_TRUE(got.unobservable.empty()) << ::testing::PrintToString(got.unobservable);
  PoseComparison const error = compare_poses(set, got.object_from_camera, truth);
  double const rounding = 4 * std::pow(2.0, -24);  // of a depth of 4
  EXPECT_LT(error.max_length, 4 * rounding);
  EXPECT_LT(error.max_deg * kDegree, 4 * rounding);
}

TEST(HardShapes, NoNoiseAndNoSigmaDoNoHarm) {
  ScanSet set = scene::ring(scene::blob(), 6, -1.2, Noise{});
  for (View& view : set.views) view.image.sigma.setTo(0, view.image.sigma == view.image.sigma);
  auto const truth = scene::poses_of(set);
  scene::set_poses(set, scene::disturbed(truth, 3, 0.04, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  expect_finite(got);
  EXPECT_EQ(got.status, AlignmentStatus::converged);
  EXPECT_EQ(got.parts.size(), 1u);
  // Between its pixels, 0.018 wide, the surface is known but for its curvature, 0.018^2 / 8 times up to 5, in both
  // views: 4e-4. The report counts 0.02 pixels for it.
  PoseComparison const error = compare_poses(set, got.object_from_camera, truth);
  EXPECT_LT(error.max_length, 5e-4);
  EXPECT_LT(error.max_deg * kDegree, 5e-4);
  for (std::size_t i = 1; i < set.views.size(); ++i) EXPECT_GT(got.poses[i].std_length, 0);
}

TEST(HardShapes, AMillionUnitsFromTheOriginNothingChanges) {
  ScanSet here = scene::ring(scene::blob(), 5, -1.2, Noise{0.003, 0, 0, 4}), there = here;
  auto const truth = scene::poses_of(here);
  auto const start = scene::disturbed(truth, 2, 0.02, 5);
  scene::set_poses(here, start);
  Eigen::Isometry3d const away(Eigen::Translation3d(1e6, -1e6, 1e6));
  for (std::size_t i = 0; i < start.size(); ++i) there.views[i].object_from_camera = away * start[i];
  Context context;
  Alignment const near = align(here, {}, context), far = align(there, {}, context);
  expect_finite(far);
  EXPECT_EQ(far.status, AlignmentStatus::converged);
  EXPECT_EQ(far.parts.size(), 1u);
  // A coordinate of 1e6 is known to 1e-10: so are the relative poses that go in. A sample on a gate's very edge may
  // fall to the other side, one of some 10^4: a hundredth of a standard deviation.
  for (std::size_t i = 1; i < start.size(); ++i) {
    Eigen::Isometry3d const a = near.object_from_camera[0].inverse() * near.object_from_camera[i];
    Eigen::Isometry3d const b = far.object_from_camera[0].inverse() * far.object_from_camera[i];
    EXPECT_LT((a * Eigen::Vector3d(0, 0, 4) - b * Eigen::Vector3d(0, 0, 4)).norm(), 0.03 * near.poses[i].std_length);
    EXPECT_NEAR(near.poses[i].std_length, far.poses[i].std_length, 1e-2 * near.poses[i].std_length);
  }
  // Errors are taken at what views share, not at the origin.
  PoseComparison const error = compare_poses(there, far.object_from_camera, [&] {
    std::vector<Eigen::Isometry3d> moved;
    for (Eigen::Isometry3d const& pose : truth) moved.push_back(away * pose);
    return moved;
  }());
  EXPECT_LT(error.max_length, 0.003);
}

}  // namespace
}  // namespace scanview
