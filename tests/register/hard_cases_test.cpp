#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "range_scene.h"
#include "register/alignment.h"
#include "register/register_section.h"

namespace scanview {
namespace {

using scene::Noise;
using scene::two_views;

double moved_in_plane(Alignment const& got, ScanSet const& set) {
  Eigen::Vector3d const d = got.object_from_camera[1].translation() - set.views[1].object_from_camera->translation();
  return std::hypot(d.x(), d.y());
}

TEST(Align, APlaneLeavesThreeMotionsOpenAndTheyAreHeld) {
  ScanSet set = two_views(scene::plane(), Noise{0.002, 0, 0, 3});
  scene::set_poses(set, scene::disturbed(scene::poses_of(set), 0, 0.02, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  EXPECT_EQ(got.unobservable.size(), 3u) << ::testing::PrintToString(got.unobservable);
  // Neither noise nor the solver may slide the plane: a hundredth of the 4 % disturbance it started with... it stays.
  EXPECT_LT(moved_in_plane(got, set), 2e-3);
  EXPECT_LT(got.pairs.at(0).median_distance, 0.004);
}

TEST(Align, PrintHoldsWhatAPlaneLeavesOpen) {
  scene::Solid printed = scene::plane();
  printed.color = scene::print;
  ScanSet set = two_views(printed, Noise{0.002, 2, 0, 3});
  auto const truth = scene::poses_of(set);
  scene::set_poses(set, scene::disturbed(truth, 0.5, 0.02, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  EXPECT_TRUE(got.unobservable.empty()) << ::testing::PrintToString(got.unobservable);
  EXPECT_LT(compare_poses(set, got.object_from_camera, truth).max_length, 0.004);
}

TEST(Align, ASphereLeavesItsThreeTurnsOpen) {
  ScanSet set = two_views(scene::sphere(), Noise{0.002, 0, 0, 3});
  scene::set_poses(set, scene::disturbed(scene::poses_of(set), 0, 0.02, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  EXPECT_EQ(got.unobservable.size(), 3u) << ::testing::PrintToString(got.unobservable);
  EXPECT_LT(got.pairs.at(0).median_distance, 0.004);
}

TEST(Align, ViewsWithoutOverlapAreLeftAloneAndNamed) {
  ScanSet set = scene::ring(scene::blob(), 2, 0, Noise{0.002, 0, 0, 3});  // opposite sides
  Context context;
  Alignment const got = align(set, {}, context);
  EXPECT_EQ(got.status, AlignmentStatus::disconnected);
  EXPECT_EQ(got.parts.size(), 2u);
  EXPECT_TRUE(got.object_from_camera[1].isApprox(*set.views[1].object_from_camera));
  EXPECT_THAT(context.warnings(), ::testing::Contains(::testing::HasSubstr("001")));
}

TEST(Align, TheSameViewTwiceCoincides) {
  ScanSet set = two_views(scene::blob(), Noise{});
  set.views[1].image = set.views[0].image;
  set.views[1].object_from_camera = set.views[0].object_from_camera;
  scene::set_poses(set, scene::disturbed(scene::poses_of(set), 2, 0.03, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  Eigen::Isometry3d const apart = got.object_from_camera[1].inverse() * got.object_from_camera[0];
  // A pixel is 0.02 wide at this distance.
  EXPECT_LT((apart * Eigen::Vector3d(0, 0, 4) - Eigen::Vector3d(0, 0, 4)).norm(), 0.002);
  EXPECT_EQ(got.status, AlignmentStatus::converged);
}

TEST(Align, HalfTheDepthsMissingIsEnough) {
  ScanSet set = scene::ring(scene::blob(), 6, -1.2, Noise{0.002, 0, 0.5, 3});
  auto const truth = scene::poses_of(set);
  scene::set_poses(set, scene::disturbed(truth, 3, 0.04, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  EXPECT_LT(compare_poses(set, got.object_from_camera, truth).median_deg, 0.15);
}

TEST(Align, AViewAloneKeepsItsPose) {
  ScanSet set = two_views(scene::blob(), Noise{});
  set.views.resize(1);
  Context context;
  Alignment const got = align(set, {}, context);
  ASSERT_EQ(got.object_from_camera.size(), 1u);
  EXPECT_TRUE(got.object_from_camera[0].isApprox(*set.views[0].object_from_camera));
  EXPECT_TRUE(got.pairs.empty());
  EXPECT_TRUE(std::isnan(got.error.rms));
  EXPECT_TRUE(got.unobservable.empty());
}

TEST(Align, AViewWithoutDepthsIsAPartOfItsOwn) {
  ScanSet set = two_views(scene::blob(), Noise{0.002, 0, 0, 1});
  View empty;
  empty.name = "void";
  empty.image = empty_range_image(set.views[0].image.camera);
  empty.object_from_camera = Eigen::Isometry3d::Identity();
  set.views.push_back(empty);
  Context context;
  Alignment const got = align(set, {}, context);
  EXPECT_EQ(got.status, AlignmentStatus::disconnected);
  EXPECT_THAT(got.parts, ::testing::ElementsAre(::testing::ElementsAre(0, 1), ::testing::ElementsAre(2)));
}

TEST(Align, SigmasFarTooSmallDoNoHarm) {
  ScanSet set = scene::ring(scene::blob(), 6, -1.2, Noise{0.003, 0, 0, 3});
  for (View& view : set.views) view.image.sigma.setTo(1e-12, view.image.sigma == view.image.sigma);
  auto const truth = scene::poses_of(set);
  scene::set_poses(set, scene::disturbed(truth, 3, 0.04, 5));
  Context context;
  Alignment const got = align(set, {}, context);
  EXPECT_LT(compare_poses(set, got.object_from_camera, truth).median_deg, 0.08);
}

TEST(Align, RefusesWhatItCannotStartFrom) {
  ScanSet set = two_views(scene::blob(), Noise{});
  set.views[1].object_from_camera.reset();
  Context context;
  EXPECT_THROW(align(set, {}, context), Error);
  ScanSet nothing;
  EXPECT_THROW(align(nothing, {}, context), Error);
  RegisterOptions bad;
  bad.levels = 0;
  EXPECT_THROW(bad.validate(), Error);
}

std::size_t count_of(std::string const& part, std::string const& text) {
  std::size_t count = 0;
  for (auto at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(RegisterSection, ShowsTheViewsItIsGivenAndNamesTheWorstPair) {
  ScanSet set = scene::ring(scene::blob(), 4, -1.2, Noise{0.003, 0, 0, 3});
  set.views[2].name = "a_view_with_a_name_that_is_as_long_as_a_folder_of_some_scanner_makes_it_2026";
  Context context;
  Alignment const got = align(set, {}, context);
  auto const before = scene::poses_of(set);
  AlignmentReview const review = review_alignment(set, before, got, context);
  ReportSection const section = register_section(set, before, got, review);
  // Two cross-sections, graph, matrix, and the four views.
  EXPECT_EQ(count_of("<img", section.html), 8U);
  EXPECT_THAT(section.html, ::testing::HasSubstr("003"));
  EXPECT_THAT(section.html, ::testing::Not(::testing::HasSubstr("nan")));
  PairFigures const* const worst = worst_pair(got);
  ASSERT_NE(worst, nullptr);
  for (PairFigures const& pair : got.pairs) EXPECT_LE(pair.median_distance, worst->median_distance);
  EXPECT_THAT(section.html, ::testing::HasSubstr("The worst pair is " + set.views[worst->a].name + " and " +
                                                 set.views[worst->b].name + ": median distance "));
}

TEST(RegisterSection, AViewAloneAndViewsApartAreShown) {
  ScanSet set = scene::ring(scene::blob(), 2, 0, Noise{0.002, 0, 0, 3});  // opposite sides
  Context context;
  for (std::size_t const views : {2U, 1U}) {
    set.views.resize(views);
    Alignment const got = align(set, {}, context);
    AlignmentReview const review = review_alignment(set, scene::poses_of(set), got, context);
    ReportSection const section = register_section(set, scene::poses_of(set), got, review);
    EXPECT_EQ(worst_pair(got), nullptr);
    EXPECT_LT(review.seen[0], 0.02);
    EXPECT_THAT(section.html, ::testing::HasSubstr(views == 2 ? "fall into 2 parts" : "nothing to align"));
    EXPECT_THAT(section.html, ::testing::Not(::testing::HasSubstr("nan")));
    EXPECT_EQ(count_of("<img", section.html), views == 2 ? 4U : 1U);
  }
}

TEST(RegisterSection, ManyViewsShowThoseThatOthersSeeLeast) {
  ScanSet set;
  Alignment alignment;
  ScanSet const ring = scene::ring(scene::blob(), 2, 0, Noise{0.002, 0, 0, 3});
  for (std::size_t i = 0; i < 30; ++i) {  // all from the first side but one
    set.views.push_back(ring.views[i == 17 ? 1 : 0]);
    set.views.back().name = std::to_string(1000 + i);
    for (std::size_t k = 0; k < i; ++k)
      if (i != 17 && k != 17) alignment.pairs.push_back({k, i, 1, 0.01, 0.001 * static_cast<double>(k), 1, false});
    alignment.parts = {{0}};
  }
  alignment.object_from_camera = scene::poses_of(set);
  alignment.poses.resize(30);
  Context context;
  AlignmentReview const review = review_alignment(set, alignment.object_from_camera, alignment, context);
  EXPECT_LT(review.seen[17], 0.02);
  EXPECT_GT(review.seen[0], 0.95);
  ASSERT_EQ(review.observers.size(), 24U);
  EXPECT_EQ(std::count_if(review.observers.begin(), review.observers.end(),
                          [](Observers const& one) { return one.view == 17; }),
            1);
  // 28 others stand at the very same place.
  Observers const& first = review.observers.front();
  EXPECT_EQ(
      cv::countNonZero(first.counts == 28) + cv::countNonZero(first.counts == -1) + cv::countNonZero(first.counts == 0),
      static_cast<int>(first.counts.total()));
  ReportSection const section = register_section(set, alignment.object_from_camera, alignment, review);
  EXPECT_EQ(count_of("<img", section.html), 28U);
  EXPECT_EQ(count_of("<tr>", section.html), 2 + 60 + 30U);
  EXPECT_THAT(section.html, ::testing::HasSubstr("The 24 of 30 views"));
  EXPECT_THAT(section.html, ::testing::HasSubstr("The 60 worst of 406 pairs"));
}

}  // namespace
}  // namespace scanview
