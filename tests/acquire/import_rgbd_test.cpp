#include <gtest/gtest.h>

#include <numbers>
#include <opencv2/core.hpp>

#include "acquire/import.h"
#include "calib/lens.h"
#include "import_fixture.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

ImportResult import_plainly(std::filesystem::path const& path) {
  Context context;
  return import_rgbd(path, {}, context);
}

TEST(ImportRgbd, GivesDepthColorAndPoseExactly) {
  TemporaryFolder folder;
  Json json = write_rgbd(folder.path(), 2);
  json["poses"] = "pose_{:03d}.txt";
  write_file(folder.path() / "pose_000.txt", pose_text(some_pose()));
  write_file(folder.path() / "pose_001.txt", pose_text(some_pose(-1)));
  write_json(folder.path() / "rgbd.json", json);
  auto const result = import_plainly(folder.path());
  ASSERT_EQ(result.set.views.size(), 2u);
  EXPECT_EQ(result.set.unit, Unit::m);
  EXPECT_TRUE(result.failed_views.empty());
  EXPECT_EQ(result.depths, 2u * 64 * 48);
  auto const& view = result.set.views[1];
  EXPECT_EQ(view.name, "001");
  EXPECT_TRUE(view.object_from_camera->isApprox(some_pose(-1), 1e-12));
  EXPECT_EQ(view.image.color(7, 9), color_picture({64, 48})(7, 9));
  // Half a step of the 16-bit value.
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) ASSERT_NEAR(view.image.depth(y, x), plane_depth(x, y), 0.00051);
  EXPECT_GT(result.set.error_budget.sampling.rms, 0);
  EXPECT_GE(result.set.error_budget.sampling.p95, 0.001 / std::sqrt(12.0) * 0.999);
  EXPECT_EQ(result.files_read.size(), 1u + 2 * 3);
}

TEST(ImportRgbd, RotatedBitsAndMissingValuesAreUndone) {
  TemporaryFolder folder;
  Json json = write_rgbd(folder.path(), 1);
  cv::Mat1w depth = depth_picture({64, 48}, plane_depth);
  depth.col(10).setTo(0);
  depth.col(11).setTo(0);
  depth(cv::Rect(30, 0, 4, 48)).setTo(65535);
  for (auto& value : depth) value = static_cast<std::uint16_t>(value << 3 | value >> 13);
  write_picture(folder.path() / "depth" / "0000.png", depth);
  json["depth_rotate_right"] = 3;
  json["missing"] = {0, 65535};
  write_json(folder.path() / "rgbd.json", json);
  auto const image = import_plainly(folder.path()).set.views.at(0).image;
  EXPECT_NEAR(image.depth(20, 40), plane_depth(40, 20), 0.00051);
  EXPECT_EQ(image.classes(20, 10), static_cast<int>(PixelClass::no_depth));
  EXPECT_EQ(image.classes(20, 31), static_cast<int>(PixelClass::no_depth));
}

TEST(ImportRgbd, SeamsOnePixelWideAreClosedOnASurfaceOnly) {
  TemporaryFolder folder;
  write_rgbd(folder.path(), 1);
  write_picture(folder.path() / "depth" / "0000.png", depth_picture({64, 48}, [](int x, int y) {
                  if (x % 5 == 0 || y % 5 == 0 || x == 33) return 0.0;  // 33: the border between two surfaces
                  return x < 33 ? 1.0 : 1.5;
                }));
  auto const image = import_plainly(folder.path()).set.views.at(0).image;
  EXPECT_NEAR(image.depth(10, 10), 1.0, 1e-6) << "a crossing of two seams";
  EXPECT_NEAR(image.depth(12, 45), 1.5, 1e-6);
  EXPECT_FALSE(image.has_depth(33, 12));
}

TEST(ImportRgbd, TurntableAnglesCarryTheObjectFromItsFirstPlace) {
  TemporaryFolder folder;
  Json json = write_rgbd(folder.path(), 3);
  json["turntable"] = {{"axis_point", {0.1, 0.2, 1.0}}, {"axis", {0, -2, 0}}, {"angles_deg", {0, 90, -30}}};
  write_json(folder.path() / "rgbd.json", json);
  auto const set = import_plainly(folder.path()).set;
  // A point one to the right of the axis. Turned by 90 degrees right-handed about (0, -1, 0), x goes to z.
  Eigen::Vector3d const first(1.1, 0.2, 1.0), second(0.1, 0.2, 2.0);
  EXPECT_TRUE((*set.views[0].object_from_camera * first).isApprox(first, 1e-12));
  EXPECT_TRUE((*set.views[1].object_from_camera * second).isApprox(first, 1e-12));
}

TEST(ImportRgbd, DepthOfItsOwnCameraIsSeenFromTheColorCameraWithoutHoles) {
  TemporaryFolder folder;
  Json json = write_rgbd(folder.path(), 1);
  // Half the resolution, 5 cm to the left and turned by 2 degrees; the surface is the plane z = 1 of the colour camera
  // with a square at 0.6 before it: the step of 0.4 is more than a slope of 80 degrees over a coarse pixel's
  // diagonal, 5.67 / 30 * 1.41 = 0.27.
  Camera const depth_camera = Camera::perspective(48, 36, 30, 30, 23.5, 17.5);
  Eigen::Isometry3d const color_from_depth =
      Eigen::Translation3d(-0.05, 0, 0) * Eigen::AngleAxisd(2 * std::numbers::pi / 180, Eigen::Vector3d::UnitY());
  auto const depth_of = [&](int x, int y) {
    Eigen::Vector3d const origin = color_from_depth.translation();
    Eigen::Vector3d const ray = color_from_depth.linear() * depth_camera.ray_direction(x, y);
    for (double plane : {0.6, 1.0}) {
      double const t = (plane - origin.z()) / ray.z();
      Eigen::Vector3d const p = origin + t * ray;
      if (plane == 1.0 || (std::abs(p.x()) < 0.11 && std::abs(p.y()) < 0.11)) return t;
    }
    return 0.0;
  };
  write_picture(folder.path() / "depth" / "0000.png", depth_picture({48, 36}, depth_of));
  json["depth_intrinsics"] = {{"width", 48}, {"height", 36}, {"fx", 30}, {"fy", 30}, {"cx", 23.5}, {"cy", 17.5}};
  json["color_from_depth"] = pose_to_json(color_from_depth);
  write_json(folder.path() / "rgbd.json", json);
  auto const image = import_plainly(folder.path()).set.views.at(0).image;
  // Rounding to 1 mm, seen from nearly the same side.
  for (int y = 18; y < 28; ++y)
    for (int x = 26; x < 36; ++x) {
      ASSERT_TRUE(image.has_depth(x, y)) << x << ' ' << y;
      ASSERT_NEAR(image.depth(y, x), 0.6, 0.0011);
    }
  for (int y = 2; y < 46; ++y) ASSERT_NEAR(image.depth(y, 8), 1.0, 0.0011) << y;
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x)
      if (double const z = image.depth(y, x); std::isfinite(z)) {
        ASSERT_LT(std::min(std::abs(z - 0.6), std::abs(z - 1.0)), 0.0011)
            << z << " is between the surfaces at " << x << ' ' << y;
      }
}

TEST(ImportRgbd, DistortionIsRemovedFromColorAndDepth) {
  TemporaryFolder folder;
  Json json = write_rgbd(folder.path(), 1);
  Lens const lens{.k1 = 0.2};
  Camera const camera = small_camera();
  // The distorted pictures of a scene that is bright and near left of the ideal column 10: there the lens shifts by
  // more than two pixels in the corners.
  cv::Mat3b color(48, 64);
  cv::Mat1w depth(48, 64);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      Eigen::Vector2d const seen = camera.ray_direction(x, y).head<2>();
      Eigen::Vector2d ideal = seen;
      for (int i = 0; i < 50; ++i) ideal = seen / (1 + lens.k1 * ideal.squaredNorm());
      bool const left = camera.project(ideal.homogeneous()).x() < 10;
      color(y, x) = left ? cv::Vec3b(200, 200, 200) : cv::Vec3b(20, 20, 20);
      depth(y, x) = left ? 1000 : 2000;
    }
  write_picture(folder.path() / "color" / "0.png", color);
  write_picture(folder.path() / "depth" / "0000.png", depth);
  json["intrinsics"]["distortion"] = {0.2, 0, 0, 0};
  write_json(folder.path() / "rgbd.json", json);
  auto const image = import_plainly(folder.path()).set.views.at(0).image;
  for (int y = 4; y < 44; ++y) {
    EXPECT_NEAR(image.depth(y, 8), 1.0f, 1e-6) << y;
    EXPECT_NEAR(image.depth(y, 12), 2.0f, 1e-6) << y;
    EXPECT_GT(image.color(y, 7)[0], 150) << y;
    EXPECT_LT(image.color(y, 12)[0], 60) << y;
  }
}

TEST(ImportRgbd, OneBadViewOfManyIsNamedAndTheRestImported) {
  TemporaryFolder folder;
  Json json = write_rgbd(folder.path(), 6);
  auto const& at = folder.path();
  json["poses"] = "pose_{}.txt";
  write_json(at / "rgbd.json", json);
  for (int i = 0; i < 6; ++i) write_file(at / fmt::format("pose_{}.txt", i), pose_text(some_pose(i)));
  std::string const bytes = read_file(at / "color" / "1.png");
  write_file(at / "color" / "1.png", bytes.substr(0, bytes.size() / 2));
  write_picture(at / "depth" / "0002.png", depth_picture({32, 24}, plane_depth));
  write_file(at / "pose_3.txt", "1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  write_file(at / "pose_4.txt", "2 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n");
  Context context;
  auto const result = import_rgbd(at, {}, context);
  EXPECT_EQ(result.set.views.size(), 2u);
  EXPECT_EQ(result.failed_views, (std::vector<std::string>{"001", "002", "003", "004"}));
  auto const warnings = context.warnings();
  ASSERT_EQ(warnings.size(), 4u);
  char const* const files[] = {"1.png", "0002.png", "pose_3.txt", "pose_4.txt"};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_NE(warnings[i].find(files[i]), std::string::npos) << warnings[i];
}

TEST(ImportRgbd, WhatCannotBeImportedAtAllIsAnErrorThatNamesItsCause) {
  TemporaryFolder folder;
  auto const& at = folder.path();
  EXPECT_SCANVIEW_ERROR(import_plainly(at / "nowhere"), ErrorCode::bad_input, "nowhere");
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "empty");
  write_file(at / "notes.txt", "x");
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "rgbd.json");
  Json const good = write_rgbd(at, 1);
  auto const with = [&](auto const& change) {
    Json json = good;
    change(json);
    write_json(at / "rgbd.json", json);
  };
  with([](Json& j) { j["colour"] = "x", j["fps"] = 30; });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "unknown key 'colour', 'fps'");
  with([](Json& j) { j.erase("intrinsics"); });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "'intrinsics' is missing");
  with([](Json& j) { j["intrinsics"].erase("fx"); });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "'fx'");
  with([](Json& j) { j["intrinsics"]["skew"] = 1; });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "unknown key 'skew' in 'intrinsics'");
  with([](Json& j) { j["color"] = "color/%d.png"; });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "{}");
  with([](Json& j) { j["depth_intrinsics"] = small_intrinsics(); });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "'color_from_depth'");
  with([](Json& j) { j["turntable"] = {{"axis_point", {0, 0, 1}}, {"axis", {0, 1, 0}}, {"angles_deg", {0, 10}}}; });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "2 entries for 1 views");
  with([](Json& j) { j["depth"] = "nothing_{}.png"; });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "nothing_0.png");
  with([](Json& j) { j["intrinsics"]["width"] = 640; });
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "64x48");
  write_file(at / "rgbd.json", "{\"color\": ");
  EXPECT_SCANVIEW_ERROR(import_plainly(at), ErrorCode::bad_input, "rgbd.json");
}

TEST(ImportRgbd, EqualResultForAnyNumberOfThreads) {
  TemporaryFolder folder;
  write_rgbd(folder.path(), 5);
  Context one, four;
  one.threads = 1, four.threads = 4;
  ImportOptions options;
  options.cut_ground = true;
  auto const a = import_rgbd(folder.path(), options, one), b = import_rgbd(folder.path(), options, four);
  ASSERT_EQ(a.set.views.size(), b.set.views.size());
  for (std::size_t i = 0; i < a.set.views.size(); ++i) {
    EXPECT_EQ(cv::norm(a.set.views[i].image.classes, b.set.views[i].image.classes, cv::NORM_INF), 0);
    EXPECT_EQ(a.set.error_budget.sampling.p95, b.set.error_budget.sampling.p95);
  }
}

TEST(ImportRgbd, StepBoxAndDepthRangeAreKept) {
  TemporaryFolder folder;
  write_rgbd(folder.path(), 5);
  ImportOptions options;
  options.step = 2;
  options.min_depth = 1.0;
  options.max_depth = 1.1;
  options.box = {Eigen::Vector3d(-0.1, -0.1, 0), Eigen::Vector3d(0.1, 0.1, 3)};
  Context context;
  auto const result = import_rgbd(folder.path(), options, context);
  ASSERT_EQ(result.set.views.size(), 3u);
  for (auto const& view : result.set.views)
    for (int y = 0; y < 48; ++y)
      for (int x = 0; x < 64; ++x)
        if (view.image.has_depth(x, y)) {
          Eigen::Vector3d const p = view.image.point(x, y);
          ASSERT_TRUE(p.z() >= 0.999 && p.z() <= 1.101 && std::abs(p.x()) <= 0.1 && std::abs(p.y()) <= 0.1);
        }
  EXPECT_GT(result.depths, 0u);
  options.step = 0;
  EXPECT_SCANVIEW_ERROR(import_rgbd(folder.path(), options, context), ErrorCode::usage, "step");
}

// ---- layouts

TEST(ImportLayouts, SevenScenesFolderNeedsNoManifest) {
  TemporaryFolder folder;
  for (int i : {0, 40}) {
    auto const stem = fmt::format("frame-{:06d}", i);
    write_picture(folder.path() / (stem + ".color.png"), color_picture({64, 48}));
    write_picture(folder.path() / (stem + ".depth.png"),
                  depth_picture({64, 48}, [](int x, int y) { return x < 9 ? 65.535 : plane_depth(x, y); }));
    write_file(folder.path() / (stem + ".pose.txt"), pose_text(some_pose(i)));
  }
  write_file(folder.path() / "camera-intrinsics.txt", "60 0 31.5\n0 62 22.5\n0 0 1\n");
  EXPECT_EQ(guess_import_kind(folder.path()), "rgbd");
  auto const set = import_plainly(folder.path()).set;
  ASSERT_EQ(set.views.size(), 2u);
  EXPECT_EQ(set.views[1].name, "000040");
  EXPECT_EQ(set.views[1].image.camera, small_camera());
  EXPECT_TRUE(set.views[1].object_from_camera->isApprox(some_pose(40), 1e-12));
  EXPECT_FALSE(set.views[1].image.has_depth(3, 20));
  EXPECT_NEAR(set.views[1].image.depth(20, 30), plane_depth(30, 20), 0.00051);
}

TEST(ImportLayouts, TumFramesAreAssociatedByTime) {
  TemporaryFolder folder;
  cv::Size const size(640, 480);
  write_file(folder.path() / "rgb.txt", "# color\n1.000 rgb/a.png\n2.000 rgb/b.png\n3.000 rgb/c.png\n");
  write_file(folder.path() / "depth.txt", "1.015 depth/a.png\n2.030 depth/b.png\n2.990 depth/c.png\n");
  write_file(folder.path() / "groundtruth.txt", "0.995 1 2 3 0 0 0 1\n3.001 4 5 6 0 0.70710678 0 0.70710678\n");
  for (char const* name : {"a.png", "b.png", "c.png"}) {
    write_picture(folder.path() / "rgb" / name, cv::Mat3b(size, cv::Vec3b(9, 9, 9)));
    write_picture(folder.path() / "depth" / name, cv::Mat1w(size, static_cast<std::uint16_t>(5000)));
  }
  Context context;
  auto const result = import_rgbd(folder.path(), {}, context);
  ASSERT_EQ(result.set.views.size(), 2u) << "b has no depth within 0.02 s";
  EXPECT_NEAR(result.set.views[0].image.depth(240, 320), 1.0, 1e-6);
  EXPECT_TRUE(result.set.views[0].object_from_camera->translation().isApprox(Eigen::Vector3d(1, 2, 3)));
  EXPECT_TRUE((result.set.views[1].object_from_camera->linear() * Eigen::Vector3d::UnitZ())
                  .isApprox(Eigen::Vector3d::UnitX(), 1e-6));
  EXPECT_EQ(result.set.views[0].image.camera.fx(), 525);
  EXPECT_FALSE(context.warnings().empty()) << "assumed intrinsics are said";
}

TEST(ImportLayouts, RedwoodTrajectoryBelongsToSortedPictures) {
  TemporaryFolder folder;
  for (int i = 0; i < 2; ++i) {
    write_picture(folder.path() / "image" / fmt::format("{}-stamp{}.png", i, 9 - i), color_picture({64, 48}));
    write_picture(folder.path() / "depth" / fmt::format("{}-other{}.png", i, i), depth_picture({64, 48}, plane_depth));
  }
  write_file(folder.path() / "trajectory.log",
             "0 0 1\n" + pose_text(some_pose(0)) + "1 1 2\n" + pose_text(some_pose(1)));
  EXPECT_SCANVIEW_ERROR(import_plainly(folder.path()), ErrorCode::bad_input, "camera_intrinsic.json is missing");
  write_json(folder.path() / "camera_intrinsic.json",
             {{"width", 64}, {"height", 48}, {"intrinsic_matrix", {60, 0, 0, 0, 62, 0, 31.5, 22.5, 1}}});
  auto const set = import_plainly(folder.path()).set;
  ASSERT_EQ(set.views.size(), 2u);
  EXPECT_EQ(set.views[1].image.camera, small_camera());
  EXPECT_TRUE(set.views[1].object_from_camera->isApprox(some_pose(1), 1e-12));
  write_file(folder.path() / "trajectory.log",
             "0 0 1\n1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n1 1 2\n" + pose_text(some_pose(1)));
  EXPECT_EQ(import_plainly(folder.path()).failed_views, std::vector<std::string>{"0000"});
}

}  // namespace
}  // namespace scanview
