#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/core.hpp>

#include "acquire/depth_noise.h"
#include "acquire/import.h"
#include "acquire/segment_background.h"
#include "acquire/segment_cut.h"
#include "acquire/segment_outliers.h"
#include "base/random.h"
#include "import_fixture.h"

namespace scanview {
namespace {

Camera scene_camera() { return Camera::perspective(160, 120, 150, 150, 79.5, 59.5); }

/// A range image of z(x, y) (NaN: missing) with noise of the model.
template <typename Depth>
RangeImage make_image(Camera const& camera, Depth const& z, DepthNoise const& noise, std::uint64_t seed,
                      double factor = 1) {
  RangeImage image = empty_range_image(camera);
  CounterRandom random(seed, 1);
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      double const depth = z(x, y);
      double const error = random.normal();
      if (!std::isfinite(depth)) continue;
      image.depth(y, x) = static_cast<float>(depth + factor * noise.sigma(depth) * error);
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
    }
  apply_noise(image, noise);
  return image;
}

DepthNoise metre_noise() { return sensor_noise(Unit::m, 0.0001, 1); }

TEST(Outliers, ScrapsThatHangByAThreadGoAndThinPartsStay) {
  RangeImage image = empty_range_image(Camera::perspective(200, 160, 200, 200, 100, 80));
  auto const add = [&](auto const& inside) {
    for (int y = 0; y < 160; ++y)
      for (int x = 0; x < 200; ++x)
        if (inside(x, y)) {
          image.depth(y, x) = 1.0F;
          image.sigma(y, x) = 0.001F;
          image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
        }
  };
  auto const disc = [](double u, double v, double r) {
    return [=](int x, int y) { return std::hypot(x - u, y - v) <= r; };
  };
  auto const bar = [](int x0, int y0, int x1, int y1) {
    return [=](int x, int y) { return x >= x0 && x < x1 && y >= y0 && y < y1; };
  };
  add(disc(80, 80, 60));       // the object, 11 300 pixels
  add(bar(139, 60, 185, 64));  // a thin part of it
  add(disc(80, 16, 8));        // a bump that sits broadly on it
  std::size_t const whole = image.count_depths();
  EXPECT_EQ(remove_hanging_scraps(image, 0.01), 0U);
  add(bar(139, 95, 155, 98));  // a thread ...
  add(disc(158, 96, 5));       // ... and a scrap of 80 pixels
  remove_hanging_scraps(image, 0.01);
  EXPECT_FALSE(image.has_depth(158, 96));
  EXPECT_TRUE(image.has_depth(180, 62));
  EXPECT_TRUE(image.has_depth(80, 10));
  EXPECT_LT(image.count_depths(), whole + 16 * 3);
}

TEST(DepthNoise, FollowsTheTriangulationFormula) {
  // 0.1 mm and 2e-3 per metre: 2.1 mm at 1 m; in millimetres the same.
  EXPECT_NEAR(sensor_noise(Unit::m, 0, 1).sigma(1), 0.0021, 1e-9);
  EXPECT_NEAR(sensor_noise(Unit::mm, 0, 1).sigma(1000), 2.1, 1e-6);
  EXPECT_NEAR(sensor_noise(Unit::m, 0, 1).sigma(2) - 1e-4, 4 * (sensor_noise(Unit::m, 0, 1).sigma(1) - 1e-4), 1e-12);
  EXPECT_GE(sensor_noise(Unit::m, 0.01, 1).sigma(0.2), 0.01 / std::sqrt(12.0));
  EXPECT_GT(DepthNoise{}.sigma(0), 0);
  EXPECT_GT(sensor_noise(Unit::arbitrary, 0, 0).sigma(0), 0);
}

TEST(DepthNoise, ScaleIsFoundFromTheScatter) {
  auto const noise = metre_noise();
  for (double const factor : {0.5, 1.0, 2.0}) {
    auto const image = make_image(
        scene_camera(), [](int x, int y) { return 1 + 0.002 * x + 0.001 * y; }, noise, 5, factor);
    // The residual RMS of 46 degrees of freedom has median 0.993 sigma; some 2000 windows leave less than 1 % of
    // scatter.
    EXPECT_NEAR(estimate_noise_scale({&image}, noise), factor, 0.04 * factor);
  }
  auto const exact = make_image(
      scene_camera(), [](int, int) { return 1.0; }, noise, 5, 0);
  EXPECT_EQ(estimate_noise_scale({&exact}, noise), 0.25) << "the model is trusted to a factor of four";
  auto const tiny = make_image(
      small_camera(), [](int x, int) { return x < 5 ? 1.0 : std::nan(""); }, noise, 5);
  EXPECT_EQ(estimate_noise_scale({&tiny}, noise), 1);
}

TEST(Outliers, FlyingPixelsAndSpecksGoSurfacesStay) {
  auto image = make_image(
      scene_camera(),
      [](int x, int y) {
        if (x == 80) return 1.2;                                       // between the surfaces
        if (std::abs(x - 30) < 2 && std::abs(y - 30) < 2) return 0.5;  // nine pixels
        return x < 80 ? 1.0 : 1.5;
      },
      metre_noise(), 3);
  remove_outliers(image);
  image.check();
  for (int y = 3; y < 117; ++y) EXPECT_EQ(image.classes(y, 80), static_cast<int>(PixelClass::outlier)) << y;
  EXPECT_EQ(image.classes(30, 30), static_cast<int>(PixelClass::outlier));
  EXPECT_TRUE(image.has_depth(79, 60));
  EXPECT_TRUE(image.has_depth(81, 60));
  EXPECT_EQ(image.count_depths(), 160u * 120 - 120 - 9);
}

TEST(Outliers, SteepSurfacesAreNoSteps) {
  // 75 degrees: tan = 3.7 pixel sizes a pixel.
  auto image = make_image(
      scene_camera(), [](int x, int) { return 1.0 + 3.7 / 150 * x * 0.5; }, metre_noise(), 3);
  EXPECT_EQ(remove_outliers(image), 0u);
}

TEST(Ground, PlaneAndWhatIsBehindItGo) {
  // A floor that is tilted against the camera; a box in front of it, a well behind it.
  Eigen::Vector3d const normal = Eigen::Vector3d(0.1, -0.6, -0.8).normalized();
  double const offset = normal.dot(Eigen::Vector3d(0, 0, 1.2));
  auto const floor = [&](int x, int y) { return offset / normal.dot(scene_camera().ray_direction(x, y)); };
  ScanSet set;
  View view;
  view.name = "a";
  view.image = make_image(
      scene_camera(),
      [&](int x, int y) {
        double const z = floor(x, y);
        if (x > 60 && x < 100 && y > 40 && y < 70) return z - 0.2;
        return x < 20 ? z + 0.3 : z;
      },
      metre_noise(), 9);
  set.views.push_back(view);
  auto const plane = find_ground(set, 1);
  ASSERT_TRUE(plane);
  // Some 15 000 points of 2 to 3 mm noise over more than 1 m.
  EXPECT_GT(plane->normal.dot(normal), std::cos(0.1 * std::numbers::pi / 180));
  EXPECT_NEAR(plane->offset, offset, 0.001);
  EXPECT_GT(plane->offset * -1, 0) << "the normal points to the camera, at the origin";
  EXPECT_EQ(find_ground(set, 1)->normal, plane->normal) << "equal seeds, equal planes";
  cut_ground(set, 1);
  auto const& image = set.views[0].image;
  image.check();
  EXPECT_TRUE(image.has_depth(80, 55));
  EXPECT_EQ(image.classes(55, 10), static_cast<int>(PixelClass::cut));
  std::size_t left = image.count_depths();
  EXPECT_NEAR(static_cast<double>(left), 39 * 29, 5) << "four sigmas: one of 30 000";
}

// ---- static background

struct SceneOptions {
  int views = 8;
  bool symmetric = false;  ///< the object's depth is the same in every view
  bool disc_dots = true;
};

struct Scene {
  ScanSet set;
  std::vector<cv::Mat1b> truth;  ///< 255 where the object is
};

/// A floor seen from above with an object that turns on it: a ball, and unless symmetric a smaller ball beside it. The
/// large ball covers the middle in every view, so what is behind it is never seen. Dots wander over the floor.
Scene turning_scene(SceneOptions const& options) {
  Scene scene;
  Camera const camera = scene_camera();
  Eigen::Vector3d const up = Eigen::Vector3d(0, -0.8, -0.6), foot(0, 0.05, 1.0);
  double const radius = 0.12;
  Eigen::Vector3d const center = foot + radius * up;
  for (int v = 0; v < options.views; ++v) {
    double const angle = 2 * std::numbers::pi * v / options.views;
    Eigen::AngleAxisd const turn(angle, up);
    Eigen::Vector3d const side = up.cross(Eigen::Vector3d::UnitX()).normalized();
    Eigen::Vector3d const satellite = foot + turn * (0.17 * side) + 0.05 * up;
    cv::Mat1b mask(camera.height(), camera.width(), static_cast<std::uint8_t>(0));
    cv::Mat3b color(camera.height(), camera.width());
    CounterRandom random(11, static_cast<std::uint64_t>(v));
    auto image = make_image(
        camera,
        [&](int x, int y) {
          Eigen::Vector3d const ray = camera.ray_direction(x, y);
          double z = foot.dot(up) / ray.dot(up);
          cv::Vec3d shade(70, 75, 80);
          Eigen::Vector3d const on_floor = turn.inverse() * (z * ray - foot);
          if (options.disc_dots)
            for (int dot = 0; dot < 6; ++dot) {
              Eigen::Vector3d const place = Eigen::AngleAxisd(dot * 1.1, up) * (0.3 * side);
              if ((on_floor - place).norm() < 0.012) shade = cv::Vec3d::all(230);
            }
          auto const ball = [&](Eigen::Vector3d const& middle, double r) {
            double const b = ray.dot(middle), q = b * b - ray.squaredNorm() * (middle.squaredNorm() - r * r);
            if (q < 0) return;
            double const near = (b - std::sqrt(q)) / ray.squaredNorm();
            if (near >= z) return;
            z = near;
            mask(y, x) = 255;
            Eigen::Vector3d const place = turn.inverse() * (near * ray - middle);
            bool const checker =
                (static_cast<int>(std::floor(place.x() / 0.03)) + static_cast<int>(std::floor(place.z() / 0.03))) % 2 ==
                0;
            shade = checker ? cv::Vec3d(40, 60, 200) : cv::Vec3d(200, 190, 60);
          };
          ball(center, radius);
          if (!options.symmetric) ball(satellite, 0.05);
          for (int c = 0; c < 3; ++c)
            color(y, x)[c] = cv::saturate_cast<std::uint8_t>(shade[c] + 1.5 * random.normal());
          return z;
        },
        metre_noise(), 100 + static_cast<std::uint64_t>(v));
    image.color = color;
    View view;
    view.name = std::to_string(v);
    view.image = image;
    scene.set.views.push_back(view);
    scene.truth.push_back(mask);
  }
  return scene;
}

double overlap(cv::Mat1b const& a, cv::Mat1b const& b) {
  return static_cast<double>(cv::countNonZero(a & b)) / std::max(1, cv::countNonZero(a | b));
}

cv::Mat1b object_of(RangeImage const& image) { return image.classes == static_cast<int>(PixelClass::object); }

TEST(Background, TurningObjectIsKeptAndTheFloorGoes) {
  auto scene = turning_scene({});
  Context context;
  remove_static_background(scene.set, context);
  for (std::size_t v = 0; v < scene.truth.size(); ++v) {
    scene.set.views[v].image.check();
    // A border one pixel wide all round an object of some 40 pixels is 10 % of it: half of that.
    EXPECT_GT(overlap(object_of(scene.set.views[v].image), scene.truth[v]), 0.95) << v;
  }
}

TEST(Background, RotationalSymmetryAloneRemovesNothing) {
  auto scene = turning_scene({.symmetric = true});
  Context context;
  remove_static_background(scene.set, context);
  for (std::size_t v = 0; v < scene.truth.size(); ++v)
    EXPECT_GT(overlap(object_of(scene.set.views[v].image), scene.truth[v]), 0.95) << v;
}

TEST(Background, ThreadsDoNotChangeTheMasks) {
  auto a = turning_scene({}), b = turning_scene({});
  Context one, four;
  one.threads = 1, four.threads = 4;
  EXPECT_EQ(remove_static_background(a.set, one), remove_static_background(b.set, four));
  for (std::size_t v = 0; v < a.truth.size(); ++v)
    EXPECT_EQ(cv::norm(a.set.views[v].image.classes, b.set.views[v].image.classes, cv::NORM_INF), 0);
}

TEST(Background, TooFewViewsOrNothingStillIsSaidAndChangesNothing) {
  auto two = turning_scene({.views = 2});
  Context context;
  EXPECT_EQ(remove_static_background(two.set, context), 0u);
  EXPECT_EQ(context.warnings().size(), 1u);
  // A wall that moves by 5 cm from view to view: nothing is still.
  ScanSet moving;
  for (int v = 0; v < 4; ++v) {
    View view;
    view.name = std::to_string(v);
    view.image = make_image(
        scene_camera(), [&](int, int) { return 1 + 0.05 * v; }, metre_noise(), 1);
    moving.views.push_back(view);
  }
  EXPECT_EQ(remove_static_background(moving, context), 0u);
  EXPECT_EQ(context.warnings().size(), 2u);
}

TEST(Background, BearMasksAreCompleteAndStable) {
  auto const folder = real_data("bear_rgbd");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "bear_rgbd is not here";
  Context context;
  auto const result = import_rgbd(folder, {}, context);
  ASSERT_EQ(result.set.views.size(), 8u);
  EXPECT_TRUE(result.failed_views.empty());
  EXPECT_EQ(result.set.unit, Unit::m);
  std::vector<std::size_t> depths;
  for (auto const& view : result.set.views) {
    // The bear is 120 to 200 pixels wide and 150 to 190 high, and fills two thirds of that.
    EXPECT_GT(view.image.count_depths(), 25'000u) << view.name;
    EXPECT_LT(view.image.count_depths(), 50'000u) << view.name;
    // Its disc, in front, and the wall are gone.
    EXPECT_EQ(cv::countNonZero(object_of(view.image)(cv::Rect(0, 320, 640, 160))), 0) << view.name;
    EXPECT_EQ(cv::countNonZero(object_of(view.image)(cv::Rect(0, 0, 640, 15))), 0) << view.name;
  }
  // The model from the other seven views gives the same mask: it does not hang on any one view.
  ImportOptions keep;
  keep.background = ImportOptions::Background::keep;
  auto const whole = import_rgbd(folder, keep, context);
  std::vector<RangeImage const*> images;
  for (auto const& view : whole.set.views) images.push_back(&view.image);
  auto const full = static_background(images);
  for (std::size_t left_out : {0u, 4u}) {
    auto others = images;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(left_out));
    EXPECT_GT(overlap(object_mask(*images[left_out], full), object_mask(*images[left_out], static_background(others))),
              0.95);
  }
}

TEST(Background, BoxMasksHoldTheBoxOnly) {
  auto const folder = real_data("box_rgbd");
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "box_rgbd is not here";
  Context context;
  auto const result = import_rgbd(folder, {}, context);
  ASSERT_EQ(result.set.views.size(), 20u);
  EXPECT_FALSE(result.set.has_poses());
  for (auto const& view : result.set.views) {
    // 100 to 200 pixels wide, 350 to 380 high.
    EXPECT_GT(view.image.count_depths(), 33'000u) << view.name;
    EXPECT_LT(view.image.count_depths(), 72'000u) << view.name;
    double nearest = 0, farthest = 0;
    cv::minMaxLoc(view.image.depth, &nearest, &farthest, nullptr, nullptr, object_of(view.image));
    EXPECT_LT(farthest, 0.62) << view.name << ": the wall is at 0.7 m";
  }
}

}  // namespace
}  // namespace scanview
