#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "base/random.h"
#include "viewer/blend/exposure.h"
#include "viewer/evaluate/held_out.h"
#include "viewer/evaluate/image_quality.h"
#include "viewer/scene.h"

namespace scanview {
namespace {

using namespace test;
using Eigen::Vector3d;

cv::Mat3b noise(int width, int height, std::uint64_t seed) {
  cv::Mat3b picture(height, width);
  CounterRandom random(seed, 0);
  for (auto& pixel : picture) {
    for (int c = 0; c < 3; ++c) pixel[c] = static_cast<std::uint8_t>(random.below(256));
  }
  return picture;
}

std::vector<Eigen::Isometry3d> ring(int count, double elevation_deg) {
  std::vector<Eigen::Isometry3d> poses;
  double const e = elevation_deg * std::numbers::pi / 180;
  for (int i = 0; i < count; ++i) {
    double const a = 2 * std::numbers::pi * i / count;
    poses.push_back(
        look_at(4 * Vector3d(std::cos(e) * std::sin(a), std::sin(e), std::cos(e) * std::cos(a)), Vector3d::Zero()));
  }
  return poses;
}

TEST(Psnr, IsTheFormulaOverTheMaskAlone) {
  cv::Mat3b const a(2, 2, cv::Vec3b(100, 100, 100));
  cv::Mat3b b = a.clone();
  b(0, 0) = {110, 100, 100};
  b(1, 1) = {0, 0, 0};
  cv::Mat1b mask(2, 2, static_cast<std::uint8_t>(255));
  mask(1, 1) = 0;
  // One channel of nine differs by 10: 10 log10(255² · 9 / 100).
  EXPECT_NEAR(psnr(a, b, mask), 10 * std::log10(255.0 * 255 * 9 / 100), 1e-9);
  EXPECT_EQ(psnr(a, a, mask), kIdenticalPsnr);
  EXPECT_EQ(psnr(a, b, cv::Mat1b(2, 2, static_cast<std::uint8_t>(0))), 0);
}

TEST(Ssim, IsOneForEqualPicturesAndNearZeroForUnrelatedOnes) {
  cv::Mat3b const a = noise(40, 30, 1), b = noise(40, 30, 2);
  cv::Mat1b const mask(30, 40, static_cast<std::uint8_t>(1));
  EXPECT_NEAR(ssim(a, a, mask), 1, 1e-12);
  EXPECT_NEAR(ssim(a, b, mask), 0, 0.1);
  EXPECT_NEAR(ssim(a, b, mask), ssim(b, a, mask), 1e-12);
}

TEST(Ssim, OfConstantPicturesIsTheLuminanceTerm) {
  cv::Mat3b const a(20, 20, cv::Vec3b(100, 100, 100)), b(20, 20, cv::Vec3b(120, 120, 120));
  cv::Mat1b const mask(20, 20, static_cast<std::uint8_t>(1));
  double const c1 = 2.55 * 2.55;
  EXPECT_NEAR(ssim(a, b, mask), (2 * 100 * 120 + c1) / (100 * 100 + 120 * 120 + c1), 1e-9);
}

TEST(Ssim, WhatLiesOutsideTheMaskHasNoInfluence) {
  cv::Mat3b const a = noise(40, 30, 3);
  cv::Mat3b b = a.clone(), c = noise(40, 30, 4);
  cv::Mat1b mask(30, 40, static_cast<std::uint8_t>(0));
  mask(cv::Rect(5, 6, 11, 9)) = 255;
  a.copyTo(c, mask);
  EXPECT_NEAR(ssim(a, c, mask), 1, 1e-12);
}

TEST(HeldOut, AViewComesBackFromTheOthersAndPeersAreComparedOnTheSamePixels) {
  auto const scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(200, 160, 190, 190, 100, 80), ring(10, 15), 0.3, 0.02);
  Context context;
  auto const library = std::make_shared<ViewLibrary>(scene.set, scene.meshes);
  auto contenders = make_contenders(scene.set, library, {}, context);
  ASSERT_GE(contenders.size(), 4U);
  auto const all = evaluate_held_out(contenders, scene.set, {0, 3}, HoldOut::each, context);
  ASSERT_EQ(all.size(), contenders.size());
  for (auto const& one : all) ASSERT_EQ(one.views.size(), 2U) << one.name;
  EXPECT_EQ(all[0].name, "view_based");
  for (auto const& f : all[0].views) {
    EXPECT_GT(f.psnr_common, 28);
    EXPECT_GT(f.ssim, 0.85);
    EXPECT_GT(f.coverage, 0.9);
    EXPECT_LE(f.psnr_all, f.psnr_common);
    EXPECT_EQ(f.rendered.size(), cv::Size(200, 160));
  }
  EXPECT_EQ(all[0].views[1].name, "003");
  for (std::size_t c = 1; c < all.size(); ++c) {
    for (std::size_t i = 0; i < 2; ++i) {
      ViewFigures const& ours = all[0].views[i];
      ViewFigures const& theirs = all[c].views[i];
      cv::Mat1b const both = ours.object & ours.drawn & theirs.drawn;
      EXPECT_NEAR(theirs.psnr_lead,
                  psnr(ours.photograph, ours.rendered, both) - psnr(theirs.photograph, theirs.rendered, both), 1e-12);
    }
    EXPECT_NEAR(all[c].psnr_lead.mean, (all[c].views[0].psnr_lead + all[c].views[1].psnr_lead) / 2, 1e-12);
  }
  auto const source = evaluate_source_views(library, scene.set, {3}, {}, context);
  EXPECT_GT(source[0].psnr_common, 38);
  EXPECT_GT(source[0].psnr_common, all[0].views[1].psnr_common);

  auto const section = evaluate_section(all, source);
  EXPECT_EQ(section.id, "evaluate");
  EXPECT_NE(section.html.find("003"), std::string::npos);
  EXPECT_NE(section.html.find("lumigraph"), std::string::npos);
}

TEST(HeldOut, ViewsHeldOutTogetherSeeNoneOfTheOthers) {
  // With every view but one held out, only that one is left to draw from.
  auto const scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(100, 80, 95, 95, 50, 40), ring(4, 15), 0.3, 0.02);
  Context context;
  auto const library = std::make_shared<ViewLibrary>(scene.set, scene.meshes);
  auto contenders = make_contenders(scene.set, library, {}, context);
  auto const together = evaluate_held_out(contenders, scene.set, {0, 1, 2}, HoldOut::together, context);
  auto const renderer = make_cpu_renderer(library);
  renderer->exclude({0, 1, 2});
  auto const frame = renderer->render(scene.set.views[0].image.camera, *scene.set.views[0].object_from_camera);
  // A quarter of a turn away: the lens that the caps of both share, at their rims.
  EXPECT_GT(together[0].views[0].coverage, 0.1);
  EXPECT_LT(together[0].views[0].coverage, 0.4);
  EXPECT_NEAR(static_cast<double>(drawn_pixels(frame.color)),
              static_cast<double>(cv::countNonZero(together[0].views[0].drawn)), 200);
}

TEST(HeldOut, TheOnlyViewCannotBeHeldOut) {
  auto const scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(40, 30, 40, 40, 20, 15), ring(1, 0), 0.3, 0.02);
  Context context;
  auto contenders = make_contenders(scene.set, std::make_shared<ViewLibrary>(scene.set, scene.meshes), {}, context);
  EXPECT_THROW(evaluate_held_out(contenders, scene.set, {0}, HoldOut::each, context), Error);
  EXPECT_THROW(evaluate_held_out(contenders, scene.set, {7}, HoldOut::each, context), Error);
}

TEST(ConfidenceInterval, IsStudents) {
  // Mean 2, standard deviation 1, three values: 2 ± 4.303 / √3.
  Interval const interval = confidence_interval({1, 2, 3});
  EXPECT_NEAR(interval.mean, 2, 1e-12);
  EXPECT_NEAR(interval.low, 2 - 4.302653 / std::sqrt(3), 1e-5);
  EXPECT_NEAR(interval.high, 2 + 4.302653 / std::sqrt(3), 1e-5);
  EXPECT_EQ(confidence_interval({5}).low, 5);
  EXPECT_EQ(confidence_interval({}).mean, 0);
}

TEST(HeldOut, APhotographIsComparedInTheSetsExposure) {
  // A gain brightens what is rendered and the photograph alike: taken for one of the two only, 40 % more light would
  // leave less than 20 dB. What remains is the rim, a fifteenth of these few pixels, whose samples are averaged.
  auto scene = scan(sphere(Vector3d::Zero(), 1), Camera::perspective(80, 60, 75, 75, 40, 30), ring(4, 15), 0.3, 0.02);
  scene.set.views[1].gain = {1.4, 1.2, 0.8};
  Context context;
  ViewBasedOptions options;
  options.fill_views = 0;  // which would add other exposures at the rim
  EXPECT_GT(
      evaluate_source_views(std::make_shared<ViewLibrary>(scene.set, scene.meshes), scene.set, {1}, options, context)[0]
          .psnr_common,
      35);
}

TEST(Exposure, FindsTheGainsThatWereTaken) {
  auto scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(160, 120, 150, 150, 80, 60), ring(8, 20), 0.3, 0.02);
  std::vector<Vector3d> taken;
  CounterRandom random(5, 0);
  for (auto& view : scene.set.views) {
    Vector3d gain;
    for (int c = 0; c < 3; ++c) gain[c] = 0.7 + 0.3 * random.uniform();
    taken.push_back(gain);
    for (auto& pixel : view.image.color) {
      for (int c = 0; c < 3; ++c) {
        double const linear = std::pow((pixel[c] / 255.0 + 0.055) / 1.055, 2.4) * gain[2 - c];
        pixel[c] = static_cast<std::uint8_t>(
            std::lround(255 * std::clamp(1.055 * std::pow(linear, 1 / 2.4) - 0.055, 0.0, 1.0)));
      }
    }
  }
  Context context;
  auto const gains = estimate_gains(scene.set, {}, context);
  for (int c = 0; c < 3; ++c) {
    double product = 0, mean = 0;
    for (std::size_t i = 0; i < gains.size(); ++i) mean += std::log(gains[i][c] * taken[i][c]) / 8;
    for (std::size_t i = 0; i < gains.size(); ++i)
      product = std::max(product, std::abs(std::log(gains[i][c] * taken[i][c]) - mean));
    // Rounding to 8 bits, the nearest pixel of a fine texture, a prior of one part in a hundred on gains within 20 %.
    EXPECT_LT(product, 0.02);
    double sum = 0;
    for (auto const& gain : gains) sum += std::log(gain[c]);
    EXPECT_NEAR(sum, 0, 0.05);
  }
}

TEST(Exposure, AViewThatSharesNothingKeepsItsOwn) {
  auto const scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(40, 30, 40, 40, 20, 15), ring(2, 0), 0.3, 0.02);
  Context context;
  for (auto const& gain : estimate_gains(scene.set, {}, context)) EXPECT_EQ(gain, Vector3d::Ones());
}

}  // namespace
}  // namespace scanview
