#include "calib/relative_pose.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>

#include "base/random.h"
#include "calib/essential_search.h"
#include "tests/expect_error.h"

namespace scanview {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

struct Scene {
  StereoRig rig;        // the truth, translation of length 1
  double relief = 0.5;  // depth varies by so much of the mean distance
  double distance = 3;  // of the scene's middle, in baselines
  bool flat = false;    // one slanted plane
  std::size_t matches = 4000;
  double noise_px = 0.3;
  double outliers = 0;  // share with a random right pixel
};

LensCamera camera(double focal, double k1 = 0) {
  return {Camera::perspective(1200, 800, focal, focal, 599.5, 399.5), Lens{k1, 0, 0, 0, 0, 0, 0, 0}};
}

/// The right camera stands to the right and looks back by `toe_deg`; `forward` turns the baseline out of the picture
/// plane, which makes the distances of the cameras unequal and with that the focal length observable.
StereoRig make_rig(double toe_deg, double forward, double focal = 1300, double k1 = -0.1) {
  StereoRig rig;
  rig.left = rig.right = camera(focal, k1);
  rig.unit = "arbitrary";
  Eigen::Isometry3d left_from_right = Eigen::Isometry3d::Identity();
  left_from_right.translation() = Eigen::Vector3d(1, 0.1, forward).normalized();
  left_from_right.linear() = (Eigen::AngleAxisd(-toe_deg * kDegree, Eigen::Vector3d::UnitY()) *
                              Eigen::AngleAxisd(3 * kDegree, Eigen::Vector3d::UnitX()))
                                 .toRotationMatrix();
  rig.right_from_left = left_from_right.inverse();
  return rig;
}

std::vector<Correspondence> sample(Scene const& scene, std::uint64_t seed) {
  CounterRandom random(seed, 1);
  std::vector<Correspondence> matches;
  while (matches.size() < scene.matches) {
    Eigen::Vector2d const pixel(1200 * random.uniform(), 800 * random.uniform());
    Eigen::Vector3d const ray = scene.rig.left.ray(pixel);
    double const depth = scene.flat ? scene.distance / (1 + 0.2 * ray.x() - 0.3 * ray.y())
                                    : scene.distance * (1 + scene.relief * (random.uniform() - 0.5));
    Eigen::Vector2d const seen = scene.rig.right.project(scene.rig.right_from_left * Eigen::Vector3d(ray * depth));
    if (!scene.rig.right.camera.contains(seen)) continue;
    auto const shake = [&] {
      return Eigen::Vector2d(scene.noise_px * random.normal(), scene.noise_px * random.normal());
    };
    bool const wrong = random.uniform() < scene.outliers;
    Eigen::Vector2d const random_pixel(1200 * random.uniform(), 800 * random.uniform());
    matches.push_back({pixel + shake(), wrong ? random_pixel : seen + shake(), static_cast<float>(scene.noise_px)});
  }
  return matches;
}

RelativePoseResult solve(Scene const& scene, std::uint64_t seed, RelativePoseOptions const& options = {},
                         double focal_error = 1) {
  Context context;
  LensCamera given = scene.rig.left;
  Camera const& c = given.camera;
  given.camera = Camera::perspective(c.width(), c.height(), c.fx() * focal_error, c.fy() * focal_error, c.cx(), c.cy());
  return solve_relative_pose(sample(scene, seed), given, given, options, context);
}

double turn_error(StereoRig const& a, StereoRig const& b) {
  return std::abs(Eigen::AngleAxisd(a.right_from_left.linear() * b.right_from_left.linear().transpose()).angle());
}

double direction_error(StereoRig const& a, StereoRig const& b) {
  return a.right_from_left.translation().cross(b.right_from_left.translation()).norm();
}

/// (estimate - truth) / standard deviation of rotation.*, translation.*.
Eigen::Matrix<double, 6, 1> normalised_errors(StereoRig const& rig, StereoRig const& truth) {
  Eigen::AngleAxisd const turn(truth.right_from_left.linear() * rig.right_from_left.linear().transpose());
  Eigen::Matrix<double, 6, 1> errors;
  errors << turn.angle() * turn.axis(), rig.right_from_left.translation() - truth.right_from_left.translation();
  char const* const names[6] = {"rotation.x",    "rotation.y",    "rotation.z",
                                "translation.x", "translation.y", "translation.z"};
  for (int k = 0; k < 6; ++k) errors[k] /= rig.standard_deviations.at(names[k]);
  return errors;
}

TEST(RelativePose, ThirtyPercentOfWrongMatchesDoNotMatter) {
  Scene scene{make_rig(15, 0.1)};
  scene.outliers = 0.3;
  for (std::uint64_t seed = 1; seed <= 2; ++seed) {
    auto const result = solve(scene, seed);
    ASSERT_TRUE(result.solved()) << result.reason;
    auto const errors = normalised_errors(result.rig, scene.rig);
    // Of six normal errors in two seeds, none beyond 4.5 standard deviations (chance 1e-4); wrong matches that lie on
    // their line by chance (a few pixels of 800) are symmetric about it.
    EXPECT_LT(errors.cwiseAbs().maxCoeff(), 4.5) << errors.transpose();
    EXPECT_LT(result.rig.standard_deviations.at("rotation.y"), 0.05 * kDegree);
    // 70 % are right; 3.5 deviations keep 99.95 % of these, and of the wrong ones some 2·√2·3.5·0.3 / 800 px = 0.4 %.
    double const share = static_cast<double>(result.inliers) / static_cast<double>(result.matches);
    EXPECT_NEAR(share, 0.7, 5 * std::sqrt(0.7 * 0.3 / 4000) + 0.005);
    // The line's distance adds both pixels' noise: median 0.6745·√2·0.3 px, here with a standard error of 1 %.
    EXPECT_NEAR(result.epipolar_median_px, 0.6745 * std::numbers::sqrt2 * 0.3, 0.05 * 0.3 * std::numbers::sqrt2);
    EXPECT_EQ(result.rig.unit, "arbitrary");
    EXPECT_NEAR(result.rig.baseline(), 1, 1e-12);
  }
}

TEST(EpipolarFit, StandardDeviationsAreHonest) {
  Scene scene{make_rig(15, 0.1)};
  scene.matches = 1500;
  constexpr int kSeeds = 40;
  Eigen::Matrix<double, 6, 1> squares = Eigen::Matrix<double, 6, 1>::Zero();
  Context context;
  for (std::uint64_t seed = 100; seed < 100 + kSeeds; ++seed)
    squares += normalised_errors(fit_epipolar(sample(scene, seed), scene.rig, {}, context).rig, scene.rig).cwiseAbs2();
  for (int k = 0; k < 6; ++k) {
    // The RMS of 40 normal numbers scatters by 1/√80 = 0.11; three times that. Below, another 10 % because the larger
    // of two estimates of the deviation is reported.
    EXPECT_NEAR(std::sqrt(squares[k] / kSeeds), 0.95, 0.38) << k;
  }
}

TEST(RelativePose, WrongFocalLengthIsFoundWhereDistancesDiffer) {
  Scene scene{make_rig(25, 0.9)};
  scene.relief = 0.8;
  scene.noise_px = 0.2;
  scene.matches = 8000;
  RelativePoseOptions options;
  options.refine_focal = true;
  auto const result = solve(scene, 5, options, 1.03);
  ASSERT_TRUE(result.solved()) << result.reason;
  EXPECT_TRUE(result.held.empty());
  double const std = result.rig.standard_deviations.at("left.fx");
  EXPECT_LT(std, 0.01 * 1300);
  EXPECT_NEAR(result.rig.left.camera.fx(), 1300, 4 * std);
  EXPECT_NEAR(result.focal_factor, 1 / 1.03, 0.01);
  EXPECT_EQ(result.rig.left.camera.fx(), result.rig.right.camera.fx());
}

TEST(RelativePose, FocalLengthIsHeldAndNamedWhereSymmetryHidesIt) {
  // Both axes meet at one point at equal distances: a critical configuration (Sturm 2001). Without distortion, whose
  // known size in pixels would tell the focal length.
  Scene scene{make_rig(0, 0, 1300, 0)};
  Eigen::Isometry3d left_from_right = Eigen::Isometry3d::Identity();
  double const toe = 20 * kDegree;
  left_from_right.linear() = Eigen::AngleAxisd(-toe, Eigen::Vector3d::UnitY()).toRotationMatrix();
  left_from_right.translation() = Eigen::Vector3d(std::cos(toe / 2), 0, std::sin(toe / 2));
  scene.rig.right_from_left = left_from_right.inverse();
  RelativePoseOptions options;
  options.refine_focal = true;
  auto const result = solve(scene, 6, options, 1.03);
  ASSERT_TRUE(result.solved()) << result.reason;
  ASSERT_EQ(result.held.size(), 1U);
  EXPECT_NE(result.held[0].find("focal length"), std::string::npos);
  EXPECT_EQ(result.focal_factor, 1);
  EXPECT_EQ(result.rig.standard_deviations.count("left.fx"), 0U);
}

TEST(RelativePose, DistortionIsFound) {
  Scene scene{make_rig(15, 0.2, 1000, -0.12)};
  scene.relief = 0.8;
  scene.matches = 6000;
  RelativePoseOptions options;
  options.refine_distortion = true;
  Context context;
  auto const result = solve_relative_pose(sample(scene, 7), camera(1000), camera(1000), options, context);
  ASSERT_TRUE(result.solved()) << result.reason;
  EXPECT_TRUE(result.held.empty());
  double const std = result.rig.standard_deviations.at("left.k1");
  EXPECT_LT(std, 0.01);
  EXPECT_NEAR(result.rig.left.lens.k1, -0.12, 4 * std);
}

TEST(RelativePose, RotationAloneIsNoBaseline) {
  Scene scene{make_rig(10, 0)};
  scene.distance = 1e6;
  auto const result = solve(scene, 8);
  EXPECT_EQ(result.status, RelativePoseResult::Status::degenerate_baseline);
  EXPECT_NE(result.reason.find("rotation alone"), std::string::npos) << result.reason;
}

TEST(RelativePose, BaselineUnderOneDegreeIsRefused) {
  Scene scene{make_rig(2, 0)};
  scene.distance = 90;  // 0.64 degrees
  scene.relief = 1;
  auto const result = solve(scene, 9);
  EXPECT_EQ(result.status, RelativePoseResult::Status::degenerate_baseline);
  EXPECT_NE(result.reason.find("meet under"), std::string::npos) << result.reason;
  EXPECT_NEAR(result.angle_deg, 0.64, 0.15);
}

// Both have the whole plane in front of them. Which of the two fits better is chance.
TEST(RelativePose, APlaneHasTwoPoses) {
  Scene scene{make_rig(15, -0.5)};
  scene.flat = true;
  for (std::uint64_t seed = 10; seed < 16; ++seed) {
    auto const result = solve(scene, seed);
    ASSERT_EQ(result.status, RelativePoseResult::Status::planar_ambiguous) << result.reason << ", seed " << seed;
    ASSERT_TRUE(result.alternative);
    StereoRig other = result.rig;
    other.right_from_left = *result.alternative;
    // One of the two is the truth.
    EXPECT_LT(std::min(turn_error(result.rig, scene.rig), turn_error(other, scene.rig)), 0.3 * kDegree);
  }
}

TEST(RelativePose, APlaneIsNotExplainedFromBehind) {
  // The plane's other pose has two fifths of the matches behind a camera, and fits better than the truth in half the
  // cases: each pose sees other components of the noise.
  Scene scene{make_rig(15, 0.1)};
  scene.flat = true;
  for (std::uint64_t seed = 1001; seed <= 1006; ++seed) {
    auto const result = solve(scene, seed);
    ASSERT_TRUE(result.solved()) << result.reason;
    EXPECT_LT(turn_error(result.rig, scene.rig), 0.3 * kDegree) << "seed " << seed;
  }
}

TEST(RelativePose, LittleReliefDecidesBetweenThePosesOfAPlane) {
  Scene scene{make_rig(15, 0.1)};
  scene.relief = 0.1;
  auto const result = solve(scene, 11);
  ASSERT_TRUE(result.solved()) << result.reason;
  EXPECT_LT(turn_error(result.rig, scene.rig), 0.5 * kDegree);
  EXPECT_LT(direction_error(result.rig, scene.rig), 5 * kDegree);
}

TEST(RelativePose, RandomMatchesAreNoConsensus) {
  Scene scene{make_rig(15, 0.1)};
  scene.outliers = 1;
  scene.matches = 500;
  auto const result = solve(scene, 12);
  EXPECT_EQ(result.status, RelativePoseResult::Status::no_consensus);
  EXPECT_FALSE(result.reason.empty());
}

TEST(RelativePose, FewMatchesAreRefused) {
  Scene scene{make_rig(15, 0.1)};
  scene.matches = 49;
  EXPECT_EQ(solve(scene, 13).status, RelativePoseResult::Status::too_few);
  Context context;
  EXPECT_EQ(solve_relative_pose({}, camera(1000), camera(1000), {}, context).status,
            RelativePoseResult::Status::too_few);
}

TEST(RelativePose, EqualForAnyNumberOfThreads) {
  Scene scene{make_rig(15, 0.1)};
  scene.outliers = 0.2;
  scene.matches = 10000;
  auto const matches = sample(scene, 14);
  Context one, many;
  one.threads = 1;
  auto const a = solve_relative_pose(matches, scene.rig.left, scene.rig.right, {}, one);
  auto const b = solve_relative_pose(matches, scene.rig.left, scene.rig.right, {}, many);
  EXPECT_EQ(a.to_json().dump(), b.to_json().dump());
}

TEST(RelativePose, BadInputIsNamed) {
  Scene scene{make_rig(15, 0.1)};
  auto matches = sample(scene, 15);
  Context context;
  matches[7].right.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_SCANVIEW_ERROR(solve_relative_pose(matches, scene.rig.left, scene.rig.right, {}, context),
                        ErrorCode::bad_input, "match 7");
  RelativePoseOptions options;
  options.threshold_px = -1;
  EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, "threshold_px");
}

TEST(EpipolarResidual, ByHand) {
  // Same orientation, baseline along x: epipolar lines are rows, and the distance is the difference of rows. Both
  // pixels may move, so the Sampson distance is that divided by √2.
  StereoRig rig;
  rig.left = rig.right = camera(1000);
  rig.right_from_left.translation() = Eigen::Vector3d(-40, 0, 0);
  auto const residual = epipolar_residual(rig, {500, 300}, {450, 303});
  EXPECT_NEAR(std::abs(residual.line_px), 3, 1e-9);
  EXPECT_NEAR(std::abs(residual.sampson_px), 3 / std::numbers::sqrt2, 1e-9);
}

TEST(EpipolarResidual, IsZeroThroughTheLens) {
  StereoRig const rig = make_rig(15, 0.3, 900, -0.2);
  Eigen::Vector3d const point(0.4, -0.6, 4);
  auto const residual = epipolar_residual(rig, rig.left.project(point), rig.right.project(rig.right_from_left * point));
  EXPECT_NEAR(residual.line_px, 0, 1e-9);
}

TEST(RayMeeting, ByHand) {
  Eigen::Isometry3d right_from_left = Eigen::Isometry3d::Identity();
  right_from_left.translation() = Eigen::Vector3d(-1, 0, 0);
  // The point (0.5, 0, 2) is seen at 0.25 and -0.25.
  RayMeeting const meeting = meet({{0.25, 0}, {-0.25, 0}}, right_from_left);
  EXPECT_NEAR(meeting.left_depth, 2, 1e-12);
  EXPECT_NEAR(meeting.right_depth, 2, 1e-12);
  EXPECT_NEAR(meeting.angle_rad, 2 * std::atan(0.25), 1e-12);
  EXPECT_LT(meet({{-0.25, 0}, {0.25, 0}}, right_from_left).left_depth, 0);
}

}  // namespace
}  // namespace scanview
