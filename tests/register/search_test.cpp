// Poses from nothing: what is found, and what is not claimed.
#include <gtest/gtest.h>

#include <cmath>

#include "range_scene.h"
#include "register/alignment.h"
#include "register/joint_refinement.h"
#include "register/pair_search.h"
#include "register/search_start.h"
#include "register/shape_features.h"

namespace scanview {
namespace {

constexpr double kSize = 2;  // of the solids
constexpr double kRadius = 1;

ScanSet without_poses(ScanSet set) {
  for (View& view : set.views) view.object_from_camera.reset();
  return set;
}

Alignment align_from_nothing(ScanSet const& set, int threads = 0) {
  RegisterOptions options;
  options.init = RegisterOptions::Init::automatic;
  Context context;
  context.threads = threads;
  return align(without_poses(set), options, context);
}

TEST(SearchStart, AShapeThatTurnsIsPutTogetherFromNothing) {
  // 36 degrees from view to view: neighbours share two thirds.
  ScanSet const set = scene::ring(scene::blob(), 10, 1.0, {0.003, 0, 0, 21});
  Alignment const got = align_from_nothing(set);
  ASSERT_EQ(got.parts.size(), 1u);
  PoseComparison const error = compare_poses(set, got.object_from_camera, scene::poses_of(set));
  // As from three degrees off (align_test): the start decides about the minimum only.
  EXPECT_LE(error.median_deg, 0.1);
  EXPECT_LE(error.median_length, 0.002 * kSize);
}

TEST(SearchStart, PrintDecidesWhereTheShapeHasSymmetries) {
  // Each quarter and half turn lays a box nearly on itself.
  ScanSet const set = scene::ring(scene::printed_box(), 12, -1.5, {0.003, 2, 0, 11});
  Alignment const got = align_from_nothing(set);
  ASSERT_EQ(got.parts.size(), 1u);
  EXPECT_LE(compare_poses(set, got.object_from_camera, scene::poses_of(set)).max_deg, 1);
}

TEST(SearchStart, ViewsThatShareNothingStandApart) {
  ScanSet set = scene::ring(scene::blob(), 2, 0, {0.003, 0, 0, 22});  // front and back
  Alignment const got = align_from_nothing(set);
  EXPECT_EQ(got.status, AlignmentStatus::disconnected);
  ASSERT_EQ(got.parts.size(), 2u);
  EXPECT_GT((got.object_from_camera[0].translation() - got.object_from_camera[1].translation()).norm(), kSize);
}

TEST(SearchStart, ThreadsDoNotChangeABit) {
  ScanSet const set = scene::ring(scene::blob(), 6, 1.0, {0.003, 0, 0, 23});
  Alignment const one = align_from_nothing(set, 1), two = align_from_nothing(set, 2);
  for (std::size_t i = 0; i < set.views.size(); ++i)
    EXPECT_EQ(one.object_from_camera[i].matrix(), two.object_from_camera[i].matrix());
}

// What ICP and projection do not bring home any more, the search does.
TEST(SearchStart, AStartThatIsFarOffIsMended) {
  ScanSet set = scene::ring(scene::blob(), 10, 1.0, {0.003, 0, 0, 26});
  set.views.resize(3);
  std::vector<Eigen::Isometry3d> const truth = scene::poses_of(set);
  scene::set_poses(set, scene::disturbed(truth, 30, 0.15 * kSize, 27));
  RegisterOptions options;
  options.given_std = 0;
  Context context;
  Alignment const got = align(set, options, context);
  EXPECT_LE(compare_poses(set, got.object_from_camera, truth).max_deg, 0.3);
}

TEST(PlaceAlong, TheFirstPairsPlaceAndLaterOnesAreNotAsked) {
  auto const moved = [](double x) { return Eigen::Isometry3d(Eigen::Translation3d(x, 0, 0)); };
  std::vector<Eigen::Isometry3d> poses(4, moved(7));
  auto const pair = [&](std::size_t a, std::size_t b, double x) {
    PairMeasurement measurement;
    measurement.a = a;
    measurement.b = b;
    measurement.b_from_a = moved(x);
    return measurement;
  };
  // 2 and 3 first among themselves, then with 1, then 1 with 0; what closes the loop comes too late.
  auto const used = place_along({pair(2, 3, 1), pair(1, 3, 5), pair(0, 1, 2), pair(0, 2, 100)}, poses);
  EXPECT_EQ(used, (std::vector<std::size_t>{0, 1, 2}));
  EXPECT_EQ(poses[0].translation().x(), 7) << "the smallest stays";
  for (auto const& [a, b, x] : {std::tuple{0, 1, 2.0}, std::tuple{1, 3, 5.0}, std::tuple{2, 3, 1.0}})
    EXPECT_NEAR((poses[static_cast<std::size_t>(b)].inverse() * poses[static_cast<std::size_t>(a)]).translation().x(),
                x, 1e-12);
  EXPECT_TRUE(place_along({}, poses).empty());
}

TEST(CheckPose, ASurfaceWhereTheOtherViewSawNothingContradicts) {
  ScanSet const set = scene::ring(scene::blob(), 10, 1.0, {0, 0, 0, 24});
  SurfacePyramid const a = build_pyramid(set.views[0].image), b = build_pyramid(set.views[1].image);
  Eigen::Isometry3d const truth = set.views[1].object_from_camera->inverse() * *set.views[0].object_from_camera;
  double const gate = 0.05 * kRadius;
  PoseCheck const right = check_pose(a.levels[0], b.levels[0], truth, gate, 2000);
  EXPECT_LT(right.contradiction(), 0.02);
  EXPECT_GT(right.overlap(), 0.4);
  // A fifth of the radius towards b's camera: a's surface is in front of b's all over.
  PoseCheck const near =
      check_pose(a.levels[0], b.levels[0], Eigen::Translation3d(0, 0, -0.2 * kRadius) * truth, gate, 2000);
  EXPECT_GT(near.contradiction(), 0.4);
  EXPECT_LT(near.score(), 0);
}

TEST(ShapeFeatures, AreTheSameInAnyUnitAndNoneOfATinyView) {
  ScanSet const set = scene::ring(scene::blob(), 10, 1.0, {0.003, 0, 0, 25});
  SurfacePyramid const view = build_pyramid(set.views[0].image);
  Features const features = find_shape_features(view.levels[1], {.radius = kRadius});
  EXPECT_GT(features.points.size(), 100u);
  ASSERT_EQ(features.points.size(), static_cast<std::size_t>(features.descriptors.rows));
  ASSERT_EQ(features.points.size(), features.normals.size());
  for (int i = 0; i < features.descriptors.rows; ++i)
    EXPECT_NEAR(cv::norm(features.descriptors.row(i)), 1, 1e-3);  // shares of three histograms, as roots
  ViewSurface few = view.levels[1];
  few.samples.resize(10);
  EXPECT_TRUE(find_shape_features(few, {.radius = kRadius}).points.empty());
}

}  // namespace
}  // namespace scanview
