#include "viewer/view_based/view_based_renderer.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "viewer/evaluate/image_quality.h"
#include "viewer/scene.h"

namespace scanview {
namespace {

using namespace test;
using Eigen::Isometry3d;
using Eigen::Vector3d;
constexpr double kDegree = std::numbers::pi / 180;

Camera small_camera() { return Camera::perspective(160, 120, 150, 155, 83.25, 56.5); }

Scene ball(std::vector<Isometry3d> const& poses, Camera const& camera = small_camera()) {
  return scan(sphere(Vector3d::Zero(), 1), camera, poses, 0.3, 0.02);
}

cv::Mat1b drawn_mask(Frame const& frame) {
  cv::Mat1b mask;
  cv::extractChannel(frame.color, mask, 3);
  return mask;
}

/// Against what a ray caster sees from there, where both see something.
double psnr_to_truth(Frame const& frame, Surface const& surface, Camera const& camera, Isometry3d const& pose) {
  View const truth = capture(surface, camera, pose, "truth");
  return psnr(bgr(frame.color), truth.image.color, drawn_mask(frame) & (truth.image.classes == 255));
}

/// What must hold whoever draws.
class BothBackEnds : public testing::TestWithParam<BackEnd> {
 protected:
  std::unique_ptr<ViewBasedRenderer> renderer_of(Scene const& scene, ViewBasedOptions const& options = {}) const {
    return make_renderer(GetParam(), std::make_shared<ViewLibrary>(scene.set, scene.meshes), options);
  }
  Frame draw(Scene const& scene, Camera const& camera, Isometry3d const& pose,
             ViewBasedOptions const& options = {}) const {
    return renderer_of(scene, options)->render(camera, pose);
  }
};
class Rendering : public BothBackEnds {};
class SoftZPixels : public BothBackEnds {};

INSTANTIATE_TEST_SUITE_P(On, Rendering, testing::Values(BackEnd::cpu, BackEnd::gl), back_end_name);
INSTANTIATE_TEST_SUITE_P(On, SoftZPixels, testing::Values(BackEnd::cpu, BackEnd::gl), back_end_name);

TEST_P(Rendering, ReproducesThePhotographAtASourceCamera) {
  auto const scene = ball({around(0, 10), around(120, 0), around(240, -10), around(10, 80)});
  auto const renderer = renderer_of(scene);
  for (std::size_t i = 0; i < scene.meshes.size(); ++i) {
    View const& view = scene.set.views[i];
    ViewMesh const& mesh = scene.meshes[i];
    auto const frame = renderer->render(small_camera(), *view.object_from_camera);
    cv::Mat1b const object = view.image.classes == 255;
    cv::Mat1b const drawn = drawn_mask(frame);
    // Texel centres fall on pixel centres: what is left is rounding to 8 bits (at most 1: 48 dB).
    // On the rim itself, which the triangles reach but do not always cover, other views may fill.
    EXPECT_GT(psnr(bgr(frame.color), view.image.color, drawn & (mesh.feather > 0)), 48);
    EXPECT_GT(psnr(bgr(frame.color), view.image.color, drawn & object), 38);
    EXPECT_GT(cv::countNonZero(drawn & object), 0.95 * cv::countNonZero(object));
    EXPECT_EQ(cv::countNonZero(drawn & ~object), 0);
    for (int y = 0; y < object.rows; ++y) {
      for (int x = 0; x < object.cols; ++x) {
        ASSERT_EQ(std::isnan(frame.depth(y, x)), drawn(y, x) == 0);
        // The view's own mesh has its vertices at pixel centres; near its rim other views have a share.
        if (drawn(y, x) != 0 && mesh.feather(y, x) == 255) {
          ASSERT_NEAR(frame.depth(y, x), view.image.depth(y, x), 1e-3);
        }
      }
    }
  }
}

TEST_P(Rendering, ReproducesAnOrthographicPhotograph) {
  Camera const camera = Camera::orthographic(150, 130, 0.02, 0.018, 70.5, 66);
  // A range image may start anywhere along the axis: depths here run from -1 to 0.
  auto const scene = scan(sphere(Vector3d::Zero(), 1), camera, {around(30, 20, 4), around(150, 0, 4)}, 0.3, 0.02);
  auto const frame = draw(scene, camera, *scene.set.views[0].object_from_camera);
  EXPECT_GT(psnr(bgr(frame.color), scene.set.views[0].image.color, drawn_mask(frame) & (scene.meshes[0].feather > 0)),
            48);
}

TEST_P(Rendering, OrthographicDepthsMayBeNegative) {
  Camera const camera = Camera::orthographic(60, 50, 0.05, 0.05, 30, 25);
  auto scene = scan(sphere(Vector3d::Zero(), 1), camera, {around(30, 20, 4)}, 0.3, 0.02);
  // The same object and picture with the image plane moved through it to its far side.
  auto const before = draw(scene, camera, *scene.set.views[0].object_from_camera);
  scene.set.views[0].image.depth -= 5;
  for (auto& vertex : scene.meshes[0].mesh.vertices) vertex.z() -= 5;
  scene.set.views[0].object_from_camera = *scene.set.views[0].object_from_camera * Eigen::Translation3d(0, 0, 5);
  auto const after = draw(scene, camera, *scene.set.views[0].object_from_camera);
  EXPECT_GT(drawn_pixels(after.color), 500U);
  EXPECT_GT(psnr(bgr(before.color), bgr(after.color), drawn_mask(before)), 60);
}

TEST_P(Rendering, PictureIsNeitherMirroredNorUpsideDown) {
  auto const scene = ball({around(0, 0)});
  auto const frame = draw(scene, small_camera(), around(0, 0));
  cv::Mat3b const truth = scene.set.views[0].image.color;
  for (int const code : {0, 1, -1}) {
    cv::Mat3b flipped;
    cv::flip(truth, flipped, code);
    EXPECT_LT(psnr(bgr(frame.color), flipped, drawn_mask(frame)), 20);
  }
}

TEST_P(Rendering, NewSidesAgreeWithARayCaster) {
  std::vector<Isometry3d> poses;
  for (int i = 0; i < 8; ++i) poses.push_back(around(45 * i, i % 2 == 0 ? 30 : -20));
  auto const scene = ball(poses, Camera::perspective(320, 240, 300, 300, 160, 120));
  auto const renderer = renderer_of(scene);
  Camera const perspective = Camera::perspective(200, 150, 190, 180, 90, 80);
  Camera const orthographic = Camera::orthographic(200, 150, 0.015, 0.016, 95, 70);
  for (auto const& camera : {perspective, orthographic}) {
    for (double const azimuth : {20.0, 100.0, 170.0, 300.0}) {
      auto const frame = renderer->render(camera, around(azimuth, 8));
      EXPECT_GT(psnr_to_truth(frame, sphere(Vector3d::Zero(), 1), camera, around(azimuth, 8)), 30);
      EXPECT_GT(drawn_pixels(frame.color), 5000U);
    }
  }
}

TEST_P(Rendering, ACroppedCameraDrawsTheCrop) {
  auto const scene = ball({around(0, 0), around(50, 20)});
  auto const renderer = renderer_of(scene);
  for (auto const& camera : {small_camera(), Camera::orthographic(160, 120, 0.02, 0.02, 81, 64)}) {
    auto const whole = renderer->render(camera, around(20, 5));
    auto const part = renderer->render(camera.cropped(45, 22, 50, 61), around(20, 5));
    cv::Mat difference;
    cv::absdiff(whole.color(cv::Rect(45, 22, 50, 61)), part.color, difference);
    // Window coordinates are snapped to 1/256 pixel after another rounding: single pixels of the outline may differ.
    cv::Mat1b different(difference.size());
    for (int y = 0; y < difference.rows; ++y) {
      for (int x = 0; x < difference.cols; ++x) {
        different(y, x) = cv::norm(difference.at<cv::Vec4b>(y, x), cv::NORM_INF) > 4 ? 255 : 0;
      }
    }
    EXPECT_LT(cv::countNonZero(different), 10);
  }
}

TEST_P(Rendering, NeverShowsTheBackgroundOfAPhotograph) {
  auto const scene = ball({around(0, 0), around(60, 0), around(30, 50)});
  auto const renderer = renderer_of(scene);
  // From near (magnified) and far (mipmaps). The background is magenta; no colour of paint() comes near to it, whose
  // green is at least 89 in 8-bit sRGB (0.1 linear) less rounding.
  for (double const distance : {2.0, 4.0, 20.0}) {
    auto const frame = renderer->render(Camera::perspective(120, 120, 110, 110, 60, 60), around(30, 15, distance));
    EXPECT_GT(drawn_pixels(frame.color), 20U);
    for (auto const& pixel : frame.color) {
      if (pixel[3] != 0) {
        ASSERT_GE(pixel[1], 86);
      }
    }
  }
}

TEST_P(Rendering, FewViewsAndCirclesGiveDefinedPictures) {
  std::vector<std::vector<Isometry3d>> sets{
      {around(0, 0)}, {around(0, 0), around(50, 10)}, {around(0, 0), around(180, 0)}};
  sets.emplace_back();
  for (int i = 0; i < 8; ++i) sets.back().push_back(around(45 * i, 32));
  for (auto const& poses : sets) {
    auto const scene = ball(poses);
    auto const renderer = renderer_of(scene);
    for (double const elevation : {-90.0, -40.0, 0.0, 60.0, 90.0}) {
      auto const pose = look_at(around(20, elevation).translation(), Vector3d::Zero(), Vector3d(0.1, 1, 0.2));
      auto const frame = renderer->render(small_camera(), pose);
      if (drawn_pixels(frame.color) < 200) continue;  // from where no view has seen the ball
      // The best view is up to 122 degrees away here (from below the turntable): textures at a grazing angle.
      EXPECT_GT(psnr_to_truth(frame, sphere(Vector3d::Zero(), 1), small_camera(), pose), 20);
    }
  }
}

TEST_P(Rendering, FrontAndBackOfAThinSheetDoNotBlend) {
  // A sheet thinner than the threshold, red in front and blue behind, seen almost from its edge.
  Vector3d const red(1, 0, 0), blue(0, 0, 1);
  auto const surface = together({sheet(0.005, 0.8, 1, red), sheet(-0.005, 0.8, -1, blue)});
  auto const scene = scan(surface, small_camera(), {around(0, 0), around(180, 0)}, 0.3, 0.1);
  auto const renderer = renderer_of(scene);
  for (double const azimuth : {20.0, 60.0, 84.0, 96.0, 120.0, 160.0}) {
    auto const frame = renderer->render(small_camera(), around(azimuth, 0));
    EXPECT_GT(drawn_pixels(frame.color), 100U);
    for (auto const& pixel : frame.color) {
      if (pixel[3] == 0) continue;
      ASSERT_EQ(pixel, azimuth < 90 ? cv::Vec4b(0, 0, 255, 255) : cv::Vec4b(255, 0, 0, 255)) << azimuth;
    }
  }
}

/// Two views from one place: the first sees a red sheet at depth 3, the second a green one `gap` behind it.
Scene two_layers(double gap, float front_cosine) {
  auto const pose = around(0, 0);
  auto scene = scan(sheet(1, 0.5, 1, {1, 0, 0}), small_camera(), {pose}, 0.3, 0.1);
  auto const behind = scan(sheet(1 - gap, 1.2, 1, {0, 1, 0}), small_camera(), {pose}, 0.3, 0.1);
  scene.set.views.push_back(behind.set.views[0]);
  scene.set.views[1].name = "001";
  scene.meshes.push_back(behind.meshes[0]);
  for (auto& c : scene.meshes[0].cos_phi) c = front_cosine;
  return scene;
}

cv::Vec4b center_of(Frame const& frame) { return frame.color(56, 83); }

TEST_P(SoftZPixels, WhatLiesBehindIsHidden) {
  auto const frame = draw(two_layers(0.5, 1), small_camera(), around(0, 0));
  EXPECT_EQ(center_of(frame), cv::Vec4b(0, 0, 255, 255));
  EXPECT_NEAR(frame.depth(56, 83), 3, 1e-4);
}

TEST_P(SoftZPixels, WithinTheThresholdAllAreAveraged) {
  // Equal weights: half red and half green in linear light, 188 in sRGB.
  auto const frame = draw(two_layers(0.05, 1), small_camera(), around(0, 0));
  EXPECT_NEAR(center_of(frame)[1], 188, 1);
  EXPECT_NEAR(center_of(frame)[2], 188, 1);
  EXPECT_NEAR(frame.depth(56, 83), 3.025, 1e-3);
}

TEST_P(SoftZPixels, WeightsRampToZeroAtOneAndAHalfThresholds) {
  // Green behind by 1.25 thresholds has half its weight: a third of the mixture, linear 1/3: 156 in sRGB.
  EXPECT_NEAR(center_of(draw(two_layers(0.125, 1), small_camera(), around(0, 0)))[1], 156, 2);
  EXPECT_EQ(center_of(draw(two_layers(0.151, 1), small_camera(), around(0, 0)))[1], 0);
}

TEST_P(SoftZPixels, AnUnreliableSampleInFrontIsIgnored) {
  auto const scene = two_layers(0.5, 0.02F);
  EXPECT_EQ(center_of(draw(scene, small_camera(), around(0, 0))), cv::Vec4b(0, 255, 0, 255));
  ViewBasedOptions options;
  options.reliability_ratio = 0;  // every sample is reliable
  EXPECT_EQ(center_of(draw(scene, small_camera(), around(0, 0), options)), cv::Vec4b(0, 0, 255, 255));
}

TEST_P(SoftZPixels, AMixtureOfSamplesWithoutWeightIsEven) {
  // No sample has a quality: cosines and feathers are all zero, where nothing is better each counts alike.
  auto scene = two_layers(0.05, 0);
  for (auto& mesh : scene.meshes) {
    mesh.feather = 0;
    for (auto& c : mesh.cos_phi) c = 0;
  }
  auto const frame = draw(scene, small_camera(), around(0, 0));
  EXPECT_NEAR(center_of(frame)[1], 188, 1);
  EXPECT_NEAR(center_of(frame)[2], 188, 1);
  // One that has quality outweighs them: the other has a ten-thousandth.
  scene.meshes[1].feather = 255;
  for (auto& c : scene.meshes[1].cos_phi) c = 1;
  auto const one = draw(scene, small_camera(), around(0, 0));
  EXPECT_EQ(center_of(one), cv::Vec4b(0, 255, 0, 255));
}

TEST_P(SoftZPixels, ASheetSeenFromItsEdgeIsALineOrNothing) {
  Vector3d const red(1, 0, 0), blue(0, 0, 1);
  auto const surface = together({sheet(0.005, 0.8, 1, red), sheet(-0.005, 0.8, -1, blue)});
  auto const scene = scan(surface, small_camera(), {around(0, 0), around(180, 0)}, 0.3, 0.1);
  auto const renderer = renderer_of(scene);
  for (double const azimuth : {88.0, 89.5, 89.99, 90.0, 90.01, 90.5, 92.0, 270.0}) {
    auto const frame = renderer->render(small_camera(), around(azimuth, 0));
    // Never wider than the sheet's own width on the screen: at 2 degrees 1.6 units x 0.035 x 39 pixels a unit.
    EXPECT_LT(drawn_pixels(frame.color), 120U * 4) << azimuth;
    for (auto const& pixel : frame.color) {
      if (pixel[3] == 0) continue;
      ASSERT_TRUE(pixel == cv::Vec4b(0, 0, 255, 255) || pixel == cv::Vec4b(255, 0, 0, 255)) << azimuth << pixel;
    }
    for (auto const depth : frame.depth) ASSERT_TRUE(std::isnan(depth) || (depth > 3 && depth < 5)) << depth;
  }
}

TEST_P(SoftZPixels, ReliabilityFadesWithTheWeight) {
  // From a sample in front that is hidden by the one behind to one that hides it there is no step: between half and
  // the whole of a twentieth of the other's rank (the default reliability_ratio).
  double last = 255;
  for (double const cosine : {0.015, 0.025, 0.03, 0.035, 0.04, 0.045, 0.05, 0.1}) {
    auto const pixel = center_of(draw(two_layers(0.5, float(cosine)), small_camera(), around(0, 0)));
    EXPECT_LE(pixel[1], last);
    last = pixel[1];
    if (cosine <= 0.025) {
      EXPECT_GT(pixel[1], 250);
    }
    if (cosine >= 0.05) {
      EXPECT_EQ(pixel, cv::Vec4b(0, 0, 255, 255));
    }
  }
}

TEST_P(SoftZPixels, TheNearPlaneMayLieInsideAMesh) {
  // The eye just above the ball's surface, looking along it: what is ahead is drawn, what is behind is not.
  auto const scene = ball({around(0, 0), around(40, 10), around(-40, 20), around(0, 60)});
  auto const renderer = renderer_of(scene);
  Camera const camera = Camera::perspective(120, 100, 60, 60, 60, 50);
  for (double const height : {0.3, 0.05, 0.005}) {
    SCOPED_TRACE(height);
    Isometry3d const pose = look_at({0, 0, 1 + height}, {1, 0, 0.7}, Vector3d::UnitZ());
    auto const frame = renderer->render(camera, pose);
    EXPECT_GT(drawn_pixels(frame.color), 1000U);
    View const truth = capture(sphere(Vector3d::Zero(), 1), camera, pose, "truth");
    int compared = 0, wrong = 0;
    for (int y = 0; y < frame.depth.rows; ++y) {
      for (int x = 0; x < frame.depth.cols; ++x) {
        if (std::isnan(frame.depth(y, x))) continue;
        ASSERT_GT(frame.depth(y, x), 0);
        if (!truth.image.has_depth(x, y)) continue;
        ++compared;
        // Flat triangles of 1/40 unit lie up to 1e-4 below the sphere: as seen along it that is much.
        wrong += std::abs(frame.depth(y, x) - truth.image.depth(y, x)) > 0.1 * truth.image.depth(y, x) + 2e-3;
      }
    }
    EXPECT_GT(compared, 800);
    EXPECT_LT(wrong, 0.05 * compared);
  }
}

TEST_P(SoftZPixels, ThresholdsOfZeroAndInfinityAreTheLimits) {
  ViewBasedOptions options;
  options.threshold = 0;
  EXPECT_EQ(center_of(draw(two_layers(0.01, 1), small_camera(), around(0, 0), options)), cv::Vec4b(0, 0, 255, 255));
  options.threshold = std::numeric_limits<double>::infinity();
  EXPECT_NEAR(center_of(draw(two_layers(0.9, 1), small_camera(), around(0, 0), options))[1], 188, 1);
}

TEST_P(Rendering, FillViewsShowWhereNoMainViewHasASample) {
  // Four views along the equator; the two near the eye have lost their lower halves.
  auto scene = ball({around(-40, 0), around(0, 0), around(40, 0), around(80, 0)});
  for (std::size_t const i : {1U, 2U}) {
    auto& mesh = scene.meshes[i];
    mesh.mesh.triangles.resize(mesh.mesh.triangles.size() / 2);
    mesh.cos_phi.resize(mesh.mesh.triangles.size());
  }
  ViewBasedOptions none;
  none.fill_views = 0;
  auto const without = draw(scene, small_camera(), around(20, 0), none);
  auto const with = draw(scene, small_camera(), around(20, 0));
  EXPECT_GT(drawn_pixels(with.color), 1.5 * static_cast<double>(drawn_pixels(without.color)));
  // Where the main views have good samples the others count a tenth of their fill, which is below 1, over weights that
  // sum to 1: of colours that differ by less than 40 levels here, three views at most 40 · 0.3 / 1.3.
  EXPECT_LT(cv::norm(center_of(with), center_of(without), cv::NORM_INF), 10);
  EXPECT_GT(psnr_to_truth(with, sphere(Vector3d::Zero(), 1), small_camera(), around(20, 0)), 25);
}

TEST_P(Rendering, WeightsOfZeroStillShowAViewThatIsAlone) {
  auto scene = ball({around(0, 0)});
  scene.meshes[0].feather = 0;
  for (auto& c : scene.meshes[0].cos_phi) c = 0;
  auto const frame = draw(scene, small_camera(), around(0, 0));
  EXPECT_GT(drawn_pixels(frame.color), 3000U);
  EXPECT_GT(psnr(bgr(frame.color), scene.set.views[0].image.color, drawn_mask(frame)), 45);
}

TEST_P(Rendering, GainMultipliesLinearLight) {
  auto scene = scan(sheet(0, 0.8, 1, {0.25, 0.25, 0.25}), small_camera(), {around(0, 0)}, 0.3, 0.1);
  scene.set.views[0].gain = {2, 1, 0.5};
  auto const pixel = center_of(draw(scene, small_camera(), around(0, 0)));
  EXPECT_NEAR(pixel[2], 188, 1);  // 0.5
  EXPECT_NEAR(pixel[1], 137, 1);  // 0.25
  EXPECT_NEAR(pixel[0], 99, 1);   // 0.125
}

TEST_P(Rendering, OnePixelIsAPicture) {
  auto const scene = ball({around(0, 0), around(60, 0)});
  auto const frame = draw(scene, Camera::perspective(1, 1, 1, 1, 0, 0), around(10, 0));
  ASSERT_EQ(frame.color.size(), cv::Size(1, 1));
  EXPECT_EQ(frame.color(0, 0)[3], 255);
}

TEST_P(Rendering, NothingIsDrawnOfWhatLiesBehindTheCamera) {
  auto const scene = ball({around(0, 0), around(60, 0)});
  auto const away = look_at({0, 0, 4}, {0, 0, 8});
  auto const frame = draw(scene, small_camera(), away);
  EXPECT_EQ(drawn_pixels(frame.color), 0U);
  EXPECT_TRUE(std::isnan(frame.depth(0, 0)));
  // From inside only back faces are seen, which are culled.
  EXPECT_EQ(drawn_pixels(draw(scene, small_camera(), look_at({0, 0, 0}, {0, 0, 1})).color), 0U);
  // And on the surface itself nothing breaks.
  draw(scene, small_camera(), look_at({0, 0, 1}, {1, 0, 1}));
}

TEST_P(Rendering, AMillionUnitsFromTheOriginLooksTheSame) {
  std::vector<Isometry3d> const poses{around(0, 10), around(60, 0)};
  auto scene = ball(poses);
  auto const near = draw(scene, small_camera(), around(25, 5));
  Eigen::Translation3d const shift(1e6, -2e6, 3e6);
  for (auto& view : scene.set.views) view.object_from_camera = shift * *view.object_from_camera;
  scene.set.center = shift * Vector3d::Zero();
  auto const far = draw(scene, small_camera(), shift * around(25, 5));
  // Poses of 1e6 units hold 1e-10 units in double, a millionth of a pixel here.
  EXPECT_EQ(drawn_pixels(near.color), drawn_pixels(far.color));
  EXPECT_GT(psnr(bgr(near.color), bgr(far.color), drawn_mask(near)), 60);
}

TEST_P(Rendering, MovingTheEyeALittleChangesThePictureALittle) {
  std::vector<Isometry3d> poses;
  for (int i = 0; i < 6; ++i) poses.push_back(around(60 * i, 25));
  poses.push_back(around(10, -60));
  auto const scene = ball(poses);
  auto const renderer = renderer_of(scene);
  // Over a whole turn and over the pole. A step of 0.02 degrees moves the ball's surface by 0.02 pixels, whose colours
  // change by at most about 25 of 255 a pixel: below 1 a step, plus 1 of rounding. A view that pops would change a
  // region.
  for (auto const& axis : {Vector3d(0.1, 1, 0), Vector3d(1, 0.1, 0.2)}) {
    for (int i = 0; i < 20; ++i) {
      auto const turned = [&](double degrees) {
        return Isometry3d(Eigen::AngleAxisd(degrees * kDegree, axis.normalized())) * around(5, 10);
      };
      auto const a = renderer->render(small_camera(), turned(18 * i));
      auto const b = renderer->render(small_camera(), turned(18 * i + 0.02));
      int worse = 0;
      for (int y = 0; y < a.color.rows; ++y) {
        for (int x = 0; x < a.color.cols; ++x) {
          if (a.color(y, x)[3] == b.color(y, x)[3] && greatest_difference(a.color(y, x), b.color(y, x)) > 3) ++worse;
        }
      }
      ASSERT_LT(worse, 40) << i;  // outlines of views within the ball
    }
  }
}

TEST_P(Rendering, ViewsWithoutTrianglesAreLeftOut) {
  auto scene = ball({around(0, 0), around(60, 0), around(30, 40)});
  scene.meshes[2].mesh = {};
  scene.meshes[2].cos_phi.clear();
  auto const renderer = renderer_of(scene);
  for (auto const& weight : renderer->view_weights(small_camera(), around(30, 40))) EXPECT_NE(weight.view, 2U);
  EXPECT_GT(drawn_pixels(renderer->render(small_camera(), around(30, 30)).color), 2000U);
}

TEST_P(Rendering, ExcludedViewsAreNotUsed) {
  auto const scene = ball({around(0, 0), around(60, 0), around(30, 40)});
  auto const renderer = renderer_of(scene);
  EXPECT_NEAR(renderer->view_weights(small_camera(), around(0, 0))[0].weight, 1, 0.01);
  renderer->exclude({0});
  for (auto const& weight : renderer->view_weights(small_camera(), around(0, 0))) EXPECT_NE(weight.view, 0U);
  EXPECT_THROW(renderer->exclude({0, 1, 2}), Error);
}

TEST_P(Rendering, RefusesWhatItCannotDraw) {
  auto scene = ball({around(0, 0)});
  auto without_pose = scene;
  without_pose.set.views[0].object_from_camera.reset();
  EXPECT_THROW(draw(without_pose, small_camera(), around(0, 0)), Error);
  auto without_mesh = scene;
  without_mesh.meshes[0].mesh = {};
  without_mesh.meshes[0].cos_phi.clear();
  EXPECT_THROW(draw(without_mesh, small_camera(), around(0, 0)), Error);
  auto wrong_cosines = scene;
  wrong_cosines.meshes[0].cos_phi.pop_back();
  EXPECT_THROW(draw(wrong_cosines, small_camera(), around(0, 0)), Error);
  Isometry3d bad = around(0, 0);
  bad.translation().x() = NAN;
  EXPECT_THROW(draw(scene, small_camera(), bad), Error);
  EXPECT_THROW(draw(scene, Camera::perspective(1 << 20, 2, 1, 1, 0, 0), around(0, 0)), Error);
  ViewBasedOptions options;
  options.reliability_ratio = 2;
  EXPECT_THROW(draw(scene, small_camera(), around(0, 0), options), Error);
}

TEST(GlContext, OsMesaAndSurfacelessEglDrawTheSame) {
  auto const scene = ball({around(0, 0), around(60, 0)});
  auto const draw = [&] {
    return make_renderer(BackEnd::gl, std::make_shared<ViewLibrary>(scene.set, scene.meshes))
        ->render(small_camera(), around(20, 10));
  };
  auto const osmesa = draw();
  std::unique_ptr<GlContext> egl;
  try {
    egl = make_offscreen_context(OffscreenKind::egl);
  } catch (Error const& error) {
    GTEST_SKIP() << error.what();
  }
  Frame frame;
  {
    auto const renderer = make_gl_renderer(*egl, std::make_shared<ViewLibrary>(scene.set, scene.meshes));
    // Both in turn: each binds itself.
    draw();
    frame = renderer->render(small_camera(), around(20, 10));
  }
  EXPECT_GT(psnr(bgr(osmesa.color), bgr(frame.color), drawn_mask(osmesa)), 40);
}

}  // namespace
}  // namespace scanview
