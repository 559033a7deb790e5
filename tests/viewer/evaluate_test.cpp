#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <opencv2/core.hpp>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"
#include "base/random.h"
#include "base/srgb.h"
#include "viewer/blend/exposure.h"
#include "viewer/evaluate/held_out.h"
#include "viewer/evaluate/image_quality.h"
#include "viewer/evaluate/lumigraph_renderer.h"
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
  ASSERT_GE(contenders.size(), 6U);
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
  // A quarter of a turn away: the lens that the caps of both share, at their rims.
  EXPECT_GT(together[0].views[0].coverage, 0.1);
  EXPECT_LT(together[0].views[0].coverage, 0.4);
}

TEST(HeldOut, ALayeredTreeIsThatOfTheViewsThatAreLeft) {
  // Orthographic views: a tree takes them, a walkthrough does not.
  auto scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::orthographic(50, 40, 0.06, 0.06, 24.5, 19.5), ring(4, 15), 0.3, 0.02);
  Context context;
  auto const tree_of = [&](std::vector<Contender>& contenders) -> HeldOutRenderer& {
    EXPECT_TRUE(
        std::none_of(contenders.begin(), contenders.end(), [](auto& one) { return one.name == "walkthrough"; }));
    auto const at =
        std::find_if(contenders.begin(), contenders.end(), [](Contender const& one) { return one.name == "ldi"; });
    return *at->renderer;
  };
  auto const library = [&] { return std::make_shared<ViewLibrary>(scene.set, scene.meshes); };
  auto all = make_contenders(scene.set, library(), {}, context);
  View const held_out = scene.set.views[1];
  auto const draw = [&](HeldOutRenderer& tree) {
    return tree.render(held_out.image.camera, *held_out.object_from_camera).color;
  };
  cv::Mat4b const with = draw(tree_of(all));
  tree_of(all).exclude({1});
  cv::Mat4b const without = draw(tree_of(all));
  EXPECT_GT(cv::norm(with, without, cv::NORM_INF), 0);
  scene.set.views.erase(scene.set.views.begin() + 1);
  scene.meshes.erase(scene.meshes.begin() + 1);
  auto left = make_contenders(scene.set, library(), {}, context);
  EXPECT_EQ(cv::norm(without, draw(tree_of(left)), cv::NORM_INF), 0);
  EXPECT_THROW(tree_of(left).exclude({0, 1, 2}), Error);
}

TEST(HeldOut, TheOnlyViewCannotBeHeldOut) {
  auto const scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(40, 30, 40, 40, 20, 15), ring(1, 0), 0.3, 0.02);
  Context context;
  auto contenders = make_contenders(scene.set, std::make_shared<ViewLibrary>(scene.set, scene.meshes), {}, context);
  EXPECT_THROW(evaluate_held_out(contenders, scene.set, {0}, HoldOut::each, context), Error);
  EXPECT_THROW(evaluate_held_out(contenders, scene.set, {7}, HoldOut::each, context), Error);
}

TEST(Lumigraph, DrawsMoreViewsThanWeEverMix) {
  // All thirty see the pole: as many layers in one pixel. (The view-based renderer draws 24 at most.)
  auto const scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(48, 36, 45, 45, 24, 18), ring(30, 80), 0.3, 0.02);
  auto const renderer = make_lumigraph_renderer(std::make_shared<ViewLibrary>(scene.set, scene.meshes));
  ViewFigures const figures = compare_with_photograph(*renderer, scene.set, 4);
  EXPECT_GT(figures.coverage, 0.95);
  EXPECT_GT(figures.psnr_common, 30);
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
  auto const exposure = estimate_exposure(scene.set, {}, context);
  auto const& gains = exposure.gains;
  // The light moved with the object: nothing to explain.
  EXPECT_FALSE(exposure.light);
  EXPECT_LT(exposure.rms_gains, 0.6 * exposure.rms_before);  // the rest is the texture at nearest pixels
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
  Exposure const exposure = estimate_exposure(scene.set, {}, context);
  for (auto const& gain : exposure.gains) EXPECT_EQ(gain, Vector3d::Ones());
  EXPECT_FALSE(exposure.light);
  EXPECT_TRUE(std::isnan(exposure.rms_before));
}

/// Multiplies every pixel by what the light gives there: a lamp that stands still with the camera.
void shine(Scene& scene, CameraLight const& light) {
  for (auto& view : scene.set.views) {
    for (int y = 0; y < view.image.camera.height(); ++y) {
      for (int x = 0; x < view.image.camera.width(); ++x) {
        if (!view.image.has_depth(x, y)) continue;
        // A ball of radius 1 about the origin.
        Vector3d const normal =
            view.object_from_camera->linear().transpose() * (*view.object_from_camera * view.image.point(x, y));
        Vector3d const factor = light.logarithm(normal.normalized()).array().exp();
        for (int c = 0; c < 3; ++c) {
          auto& value = view.image.color(y, x)[2 - c];
          value = static_cast<std::uint8_t>(
              std::lround(255 * srgb_from_linear(std::min(1.0, linear_from_srgb(value / 255.0) * factor[c]))));
        }
      }
    }
  }
}

CameraLight lamp() {
  CameraLight light;
  light.coefficients.row(0).setConstant(0.3);   // from the right
  light.coefficients.row(1).setConstant(-0.2);  // and above
  light.coefficients.row(2) << 0.1, 0.15, 0.2;  // bluer at the rim
  return light;
}

TEST(Exposure, FindsALampThatStandsWithTheCamera) {
  auto scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(160, 120, 150, 150, 80, 60), ring(8, 20), 0.3, 0.02);
  shine(scene, lamp());
  Context context;
  Exposure const exposure = estimate_exposure(scene.set, {}, context);
  ASSERT_TRUE(exposure.light);
  EXPECT_LT(exposure.rms_light, 0.5 * exposure.rms_gains);
  for (auto const& gain : exposure.gains) EXPECT_LT(gain.array().log().abs().maxCoeff(), 0.02);
  // Views on one circle never turn a normal from left to up: what only such pairs would show stays at the prior, so the
  // light is compared where it matters, between the normals that one place has in two neighbouring views. The rest of
  // difference is the texture's detail at nearest pixels, 0.02 in 150 of brightness a pixel, and the prior's share.
  Vector3d const normal = Vector3d(0.3, -0.2, -1).normalized();
  Vector3d const turned = Eigen::AngleAxisd(std::numbers::pi / 4, Vector3d::UnitY()) * normal;
  Vector3d const expected = lamp().logarithm(turned) - lamp().logarithm(normal);
  Vector3d const found = exposure.light->logarithm(turned) - exposure.light->logarithm(normal);
  EXPECT_LT((expected - found).cwiseAbs().maxCoeff(), 0.05);
  // Gains alone are what is asked for with `never`.
  ExposureOptions never;
  never.light = ExposureOptions::Light::never;
  EXPECT_FALSE(estimate_exposure(scene.set, never, context).light);
}

TEST(Exposure, ALampMakesHeldOutViewsBetterOnBothBackEnds) {
  auto scene =
      scan(sphere(Vector3d::Zero(), 1), Camera::perspective(160, 120, 150, 150, 80, 60), ring(8, 20), 0.3, 0.02);
  shine(scene, lamp());
  auto const draw_held_out = [&](bool with_light, bool on_gl) {
    scene.set.light.reset();
    if (with_light) scene.set.light = lamp();
    auto const library = std::make_shared<ViewLibrary>(scene.set, scene.meshes);
    ViewBasedOptions options;
    options.excluded = {2};
    auto const gl = on_gl ? make_offscreen_context() : nullptr;
    auto const renderer = on_gl ? make_gl_renderer(*gl, library, options) : make_cpu_renderer(library, options);
    return compare_with_photograph(*renderer, scene.set, 2);
  };
  auto const without = draw_held_out(false, false), with = draw_held_out(true, false), gl = draw_held_out(true, true);
  // The lamp's halves differ by a factor of two between neighbouring views; relit, what is left is the texture.
  EXPECT_GT(with.psnr_common, without.psnr_common + 4);
  EXPECT_GT(psnr(with.rendered, gl.rendered, with.drawn & gl.drawn), 50);
}

TEST(Exposure, TheLightIsKeptInTheManifest) {
  auto scene = scan(sphere(Vector3d::Zero(), 1), Camera::perspective(40, 30, 40, 40, 20, 15), ring(2, 0), 0.3, 0.02);
  auto const folder = std::filesystem::path(testing::TempDir()) / "scanview_light_test";
  std::filesystem::create_directories(folder);
  scene.set.light = lamp();
  write_manifest(folder, scene.set);
  ASSERT_TRUE(read_manifest(folder).light);
  EXPECT_EQ(read_manifest(folder).light->coefficients, lamp().coefficients);
  scene.set.light.reset();
  write_manifest(folder, scene.set);
  EXPECT_FALSE(read_manifest(folder).light);
  Json manifest = read_json(folder / "scanset.json");
  manifest["light"] = Json::array({1, 2});
  write_json(folder / "scanset.json", manifest);
  EXPECT_THROW(read_manifest(folder), Error);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace scanview
