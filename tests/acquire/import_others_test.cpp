#include <gtest/gtest.h>

#include <algorithm>

#include "acquire/archive.h"
#include "acquire/import.h"
#include "acquire/import_build.h"
#include "base/html.h"
#include "import_fixture.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

// ---- Stanford

/// A scan of 40 x 30 cells, half a millimetre apart, of the surface z = 0.01 + 0.2 x - 0.1 y, without a corner.
std::string range_grid() {
  std::string points, cells;
  int vertices = 0;
  for (int row = 0; row < 30; ++row)
    for (int col = 0; col < 40; ++col) {
      if (row < 10 && col < 10) {
        cells += "0\n";
        continue;
      }
      double const x = 0.0005 * col, y = 0.0005 * row;
      points += fmt::format("{:.9g} {:.9g} {:.9g}\n", x, y, 0.01 + 0.2 * x - 0.1 * y);
      cells += fmt::format("1 {}\n", vertices++);
    }
  return fmt::format(
             "ply\nformat ascii 1.0\nobj_info num_cols 40\nobj_info num_rows 30\nbye\nelement vertex {}\nproperty "
             "float x\nproperty "
             "float y\nproperty float z\nelement range_grid 1200\nproperty list uchar int vertex_indices\nend_header\n",
             vertices) +
         points + cells;
}

TEST(ImportStanford, RangeGridBecomesAnOrthographicViewOfTheSamePoints) {
  TemporaryFolder folder;
  write_file(folder.path() / "a.ply", range_grid());
  write_file(folder.path() / "b.ply", range_grid());
  // A quarter turn about y, whose inverse the quaternion is: R(q)^T carries x to -z ... so p -> R^T p + t.
  write_file(
      folder.path() / "two.conf",
      "camera 0 0 0 0 0 0 1\nbmesh a.ply 0 0 0 0 0 0 1\nbmesh b.ply 1 2 3 0 0.7071067811865476 0 0.7071067811865476\n");
  EXPECT_EQ(guess_import_kind(folder.path()), "stanford");
  Context context;
  auto const result = import_stanford(folder.path(), {}, context);
  ASSERT_EQ(result.set.views.size(), 2u);
  EXPECT_EQ(result.set.unit, Unit::m);
  auto const& view = result.set.views[0];
  EXPECT_EQ(view.image.camera.model(), Camera::Model::orthographic);
  EXPECT_NEAR(1 / view.image.camera.fx(), 0.0005, 1e-9);
  EXPECT_GT(view.image.count_depths(), 1000u);
  for (std::size_t v = 0; v < 2; ++v)
    for (int y = 0; y < view.image.depth.rows; ++y)
      for (int x = 0; x < view.image.depth.cols; ++x) {
        if (!result.set.views[v].image.has_depth(x, y)) continue;
        Eigen::Vector3d p = *result.set.views[v].object_from_camera * result.set.views[v].image.point(x, y);
        // Undo the conf's pose: R(q) (p - t), R(q) turns by 90 degrees about y: (x, y, z) -> (z, y, -x).
        if (v == 1) p = p - Eigen::Vector3d(1, 2, 3), p = Eigen::Vector3d(p.z(), p.y(), -p.x());
        // Bilinear resampling reproduces a plane; depths are 32-bit floats of about 0.1.
        ASSERT_NEAR(p.z(), 0.01 + 0.2 * p.x() - 0.1 * p.y(), 1e-7);
        ASSERT_TRUE(p.x() > 0.0044 || p.y() > 0.0044) << "the missing corner stays missing";
      }
  // It looks along -z of the scan: the view direction, carried to the world.
  EXPECT_TRUE((view.object_from_camera->linear() * Eigen::Vector3d::UnitZ()).isApprox(-Eigen::Vector3d::UnitZ()));
  EXPECT_GT(view.image.color(10, 30)[0], 150) << "a surface that faces the camera is bright";
}

TEST(ImportStanford, DamagedScansAreLeftOutAndNamed) {
  TemporaryFolder folder;
  std::string const good = range_grid();
  write_file(folder.path() / "good.ply", good);
  write_file(folder.path() / "short.ply", good.substr(0, good.size() / 2));
  std::string huge = good;
  huge.replace(huge.find("element vertex"), std::string("element vertex").size() + 5, "element vertex 4000000000");
  write_file(folder.path() / "huge.ply", huge);
  write_file(folder.path() / "x.conf",
             "bmesh good.ply 0 0 0 0 0 0 1\nbmesh short.ply 0 0 0 0 0 0 1\nbmesh huge.ply 0 0 0 0 0 0 1\n"
             "bmesh absent.ply 0 0 0 0 0 0 1\nbmesh good.ply 0 nan 0 0 0 0 1\nbmesh good.ply 0 0 0 0 0 0 2\n");
  Context context;
  auto const result = import_stanford(folder.path() / "x.conf", {}, context);
  EXPECT_EQ(result.set.views.size(), 1u);
  EXPECT_EQ(result.failed_views, (std::vector<std::string>{"short", "huge", "absent", "good_2", "good_3"}));
  EXPECT_SCANVIEW_ERROR(import_stanford(folder.path() / "nothing", {}, context), ErrorCode::bad_input, "nothing");
  write_file(folder.path() / "x.conf", "nothing here\n");
  EXPECT_SCANVIEW_ERROR(import_stanford(folder.path(), {}, context), ErrorCode::bad_input, "bmesh");
  TemporaryFolder empty;
  EXPECT_SCANVIEW_ERROR(import_stanford(empty.path(), {}, context), ErrorCode::bad_input, "empty");
}

TEST(ImportStanford, ADamagedArchiveIsAnError) {
  TemporaryFolder folder;
  write_file(folder.path() / "x.tar.xz", "this is no archive");
  Context context;
  EXPECT_SCANVIEW_ERROR(import_stanford(folder.path() / "x.tar.xz", {}, context), ErrorCode::bad_input, "x.tar.xz");
}

TEST(ImportStanford, BunnyScansOverlapWithTheirPoses) {
  auto const archive = real_data("bunny_range.tar.xz");
  if (!std::filesystem::exists(archive)) GTEST_SKIP() << "bunny_range.tar.xz is not here";
  Context context;
  auto const set = import_stanford(archive, {}, context).set;
  ASSERT_EQ(set.views.size(), 10u);
  // Distance from points of one view to the nearest sample of another that lies within 4 pixels of where they fall.
  std::vector<double> distances;
  for (auto const& a : set.views)
    for (auto const& b : set.views) {
      if (&a == &b) continue;
      Eigen::Isometry3d const b_from_a = b.object_from_camera->inverse() * *a.object_from_camera;
      for (int y = 0; y < a.image.depth.rows; y += 7)
        for (int x = 0; x < a.image.depth.cols; x += 7) {
          if (!a.image.has_depth(x, y)) continue;
          Eigen::Vector3d const p = b_from_a * a.image.point(x, y);
          Eigen::Vector2d const pixel = b.image.camera.project(p);
          double nearest = 0.002;
          for (int v = std::max(0, static_cast<int>(pixel.y()) - 4);
               v < std::min(b.image.depth.rows, static_cast<int>(pixel.y()) + 5); ++v)
            for (int u = std::max(0, static_cast<int>(pixel.x()) - 4);
                 u < std::min(b.image.depth.cols, static_cast<int>(pixel.x()) + 5); ++u)
              if (b.image.has_depth(u, v)) nearest = std::min(nearest, (b.image.point(u, v) - p).norm());
          if (nearest < 0.002) distances.push_back(nearest);
        }
    }
  ASSERT_GT(distances.size(), 5000u);
  std::nth_element(distances.begin(), distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2),
                   distances.end());
  EXPECT_LE(distances[distances.size() / 2], 0.00045);
}

// ---- nerfstudio

TEST(ImportStanford, DrawnColourIsKnownFromPaint) {
  RangeImage image = empty_range_image(Camera::perspective(60, 50, 80, 80, 29.5, 24.5));
  for (int y = 5; y < 45; ++y)
    for (int x = 5; x < 55; ++x) {
      image.depth(y, x) = 2 + 0.001F * static_cast<float>((x - 30) * (x - 30) + (y - 25) * (y - 25));
      image.sigma(y, x) = 1e-3F;
      image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
    }
  EXPECT_FALSE(is_drawn_shading(image)) << "black";
  image.color = shade_by_normal(image);
  EXPECT_TRUE(is_drawn_shading(image));
  for (int x = 10; x < 30; ++x) image.remove(x, 20, PixelClass::cut);  // since it was drawn
  EXPECT_TRUE(is_drawn_shading(image));
  RangeImage painted = image;
  painted.color = image.color.clone();
  painted.color(20, 40) = {10, 20, 30};
  EXPECT_FALSE(is_drawn_shading(painted));
  painted.color = image.color * 0.7;
  EXPECT_FALSE(is_drawn_shading(painted)) << "gray, of another lamp";
}

TEST(ImportNerfstudio, AxesMaskAndUnitsAreTheirsTurnedIntoOurs) {
  TemporaryFolder folder;
  auto const& at = folder.path();
  write_picture(at / "images" / "f1.png", color_picture({64, 48}));
  write_picture(at / "depth" / "f1.png", depth_picture({64, 48}, plane_depth));
  cv::Mat1b mask(48, 64, static_cast<std::uint8_t>(255));
  mask(cv::Rect(0, 0, 20, 48)).setTo(0);
  write_picture(at / "masks" / "f1.png", mask);
  Json frame{{"file_path", "images/f1.png"},
             {"depth_file_path", "depth/f1.png"},
             {"mask_path", "masks/f1.png"},
             {"transform_matrix", {{1, 0, 0, 5}, {0, 1, 0, 6}, {0, 0, 1, 7}, {0, 0, 0, 1}}}};
  Json json{{"fl_x", 60},
            {"fl_y", 62},
            {"cx", 32},
            {"cy", 23},
            {"w", 64},
            {"h", 48},
            {"depth_unit_scale_factor", 0.002},
            {"frames", {frame}}};
  write_json(at / "transforms.json", json);
  EXPECT_EQ(guess_import_kind(at), "nerfstudio");
  Context context;
  auto const set = import_nerfstudio(at, {}, context).set;
  ASSERT_EQ(set.views.size(), 1u);
  EXPECT_EQ(set.unit, Unit::arbitrary);
  auto const& view = set.views[0];
  EXPECT_EQ(view.image.camera, small_camera()) << "their principal point counts from the corner";
  EXPECT_TRUE((*view.object_from_camera * Eigen::Vector3d(1, 2, 3)).isApprox(Eigen::Vector3d(6, 4, 4)));
  EXPECT_NEAR(view.image.depth(20, 40), 2 * plane_depth(40, 20), 0.0011);
  EXPECT_EQ(view.image.classes(20, 10), static_cast<int>(PixelClass::background));
  json["frames"][0].erase("depth_file_path");
  write_json(at / "transforms.json", json);
  EXPECT_SCANVIEW_ERROR(import_nerfstudio(at, {}, context), ErrorCode::bad_input, "depth_file_path");
  json["frames"] = {frame};
  json.erase("fl_x");
  write_json(at / "transforms.json", json);
  EXPECT_SCANVIEW_ERROR(import_nerfstudio(at, {}, context), ErrorCode::bad_input, "intrinsics are missing");
  json["fl_x"] = 60;
  json["frames"][0]["transform_matrix"][0][0] = 3;
  write_json(at / "transforms.json", json);
  EXPECT_SCANVIEW_ERROR(import_nerfstudio(at, {}, context), ErrorCode::bad_input, "no rotation");
}

// ---- COLMAP

void write_depth_map(std::filesystem::path const& path, std::string const& header, cv::Mat1f const& depth) {
  std::filesystem::create_directories(path.parent_path());
  std::string bytes = header;
  bytes.append(reinterpret_cast<char const*>(depth.data), 4 * depth.total());
  write_file(path, bytes);
}

TEST(ImportColmap, TextModelAndDepthMapsGiveTheScene) {
  TemporaryFolder folder;
  auto const& at = folder.path();
  Eigen::Isometry3d const pose = some_pose();
  Eigen::Isometry3d const inverse = pose.inverse();
  Eigen::Quaterniond const q(inverse.linear());
  std::filesystem::create_directories(at / "sparse" / "0");
  write_file(at / "sparse" / "0" / "cameras.txt",
             "# comment\n1 PINHOLE 64 48 60 62 32 23\n2 SIMPLE_RADIAL 64 48 60 32 23 0.1\n3 OPENCV 64 48 60 62 32 23 "
             "0.1 0 0 0\n");
  std::string images;
  for (int i = 1; i <= 4; ++i)  // the fourth names a camera that is not there
    images += fmt::format("{} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {} dir/im{}.png\n{}\n", i, q.w(),
                          q.x(), q.y(), q.z(), inverse.translation().x(), inverse.translation().y(),
                          inverse.translation().z(), i == 4 ? 9 : i, i, i % 2 == 0 ? "1.0 2.0 -1" : "");
  write_file(at / "sparse" / "0" / "images.txt", images);
  cv::Mat1f depth(48, 64);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) depth(y, x) = x < 5 ? 0.0f : static_cast<float>(plane_depth(x, y));
  for (int i = 1; i <= 4; ++i) {
    write_picture(at / "images" / "dir" / fmt::format("im{}.png", i), color_picture({64, 48}));
    write_depth_map(
        at / "stereo" / "depth_maps" / "dir" / fmt::format("im{}.png.{}.bin", i, i == 2 ? "photometric" : "geometric"),
        "64&48&1&", depth);
  }
  EXPECT_EQ(guess_import_kind(at), "colmap");
  Context context;
  auto const result = import_colmap(at, {}, context);
  ASSERT_EQ(result.set.views.size(), 3u);
  EXPECT_EQ(result.failed_views.size(), 1u);
  auto const& view = result.set.views[0];
  EXPECT_EQ(view.name, "dir_im1");
  EXPECT_EQ(view.image.camera, small_camera());
  EXPECT_TRUE(view.object_from_camera->isApprox(pose, 1e-12));
  EXPECT_NEAR(view.image.depth(20, 40), plane_depth(40, 20), 1e-6);
  EXPECT_FALSE(view.image.has_depth(2, 20));
  for (int i = 1; i <= 4; ++i)
    write_depth_map(at / "stereo" / "depth_maps" / "dir" / fmt::format("im{}.png.geometric.bin", i), "30000&30000&1&",
                    depth);
  EXPECT_SCANVIEW_ERROR(import_colmap(at, {}, context), ErrorCode::bad_input, "30000x30000 depths promised");
  write_file(at / "sparse" / "0" / "cameras.txt", "1 FISHEYE 64 48 60 62 32 23\n");
  EXPECT_SCANVIEW_ERROR(import_colmap(at, {}, context), ErrorCode::bad_input, "FISHEYE");
}

TEST(ImportSection, ShowsEveryView) {
  TemporaryFolder folder;
  write_rgbd(folder.path(), 3);
  Context context;
  auto const section = import_section(import_rgbd(folder.path(), {}, context).set);
  EXPECT_EQ(section.id, "import");
  for (char const* name : {"view 000", "view 001", "view 002", "image/jpeg", "image/png"})
    EXPECT_NE(section.html.find(name), std::string::npos) << name;
}

}  // namespace
}  // namespace scanview
