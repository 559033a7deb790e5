#include "acquire/export.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <sstream>

#include "base/files.h"
#include "base/image_file.h"
#include "base/ply.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// A slanted plane with a hole, a cut corner and a background, seen by two cameras.
View make_view(std::string const& name, Camera const& camera, Isometry3d const& pose) {
  View view;
  view.name = name;
  view.object_from_camera = pose;
  view.image = empty_range_image(camera);
  view.image.color.create(camera.height(), camera.width());
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      view.image.color(y, x) = {uchar(3 * x), uchar(2 * y), uchar(x + y)};
      auto& what = view.image.classes(y, x);
      if (x < 4) what = static_cast<uchar>(PixelClass::background);
      if (x >= 4 && y < 3) what = static_cast<uchar>(PixelClass::cut);
      if (x < 4 || y < 3 || (x > 20 && x < 24 && y > 10 && y < 14)) continue;
      what = static_cast<uchar>(PixelClass::object);
      view.image.depth(y, x) = 200 + 0.5f * x + 0.25f * y;
      view.image.sigma(y, x) = 0.1f;
    }
  view.image.check();
  return view;
}

ScanSet make_set() {
  ScanSet set;
  set.unit = Unit::mm;
  set.center = {0, 0, 220};
  Isometry3d second = Isometry3d::Identity();
  second.rotate(Eigen::AngleAxisd(0.7, Vector3d(1, 2, -0.5).normalized()));
  second.pretranslate(Vector3d(30, -20, 10));
  set.views.push_back(make_view("000", Camera::perspective(40, 30, 50, 51, 19.25, 14.5), Isometry3d::Identity()));
  set.views.push_back(make_view("left", Camera::perspective(36, 28, 48, 47, 17.5, 13.75), second));
  return set;
}

/// Lines that are no comments, each split at blanks; empty lines are kept.
std::vector<std::vector<std::string>> read_table(fs::path const& path) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream text(read_file(path));
  for (std::string line; std::getline(text, line);) {
    if (line.starts_with('#')) continue;
    std::istringstream words(line);
    rows.emplace_back(std::istream_iterator<std::string>(words), std::istream_iterator<std::string>());
  }
  return rows;
}

/// Every depth of the set, in the order of views, rows, columns.
std::vector<Vector3d> points_of(ScanSet const& set) {
  std::vector<Vector3d> points;
  for (View const& view : set.views)
    for (int y = 0; y < view.image.depth.rows; ++y)
      for (int x = 0; x < view.image.depth.cols; ++x)
        if (view.image.has_depth(x, y)) points.push_back(*view.object_from_camera * view.image.point(x, y));
  return points;
}

TEST(ExportPointCloud, HoldsEveryDepthInObjectCoordinates) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_set();
  export_point_cloud(folder.path() / "cloud.ply", set, context);
  PlyFile const ply = read_ply(folder.path() / "cloud.ply");
  PlyElement const* vertex = ply.find("vertex");
  ASSERT_NE(vertex, nullptr);
  auto const points = points_of(set);
  ASSERT_EQ(vertex->rows, points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    Vector3d const p(vertex->find("x")->values[i], vertex->find("y")->values[i], vertex->find("z")->values[i]);
    EXPECT_LT((p - points[i]).norm(), 512 * 0x1p-24);  // float rounding of coordinates below 256
  }
  EXPECT_EQ(vertex->find("red")->type, PlyType::uint8);
  EXPECT_EQ(vertex->find("red")->values[0], 4 + 3);  // the first depth is at (4, 3)
  EXPECT_EQ(vertex->find("green")->values[0], 2 * 3);
  EXPECT_EQ(vertex->find("blue")->values[0], 3 * 4);
}

TEST(ExportPointCloud, NormalsAreUnitTowardsTheCameraOrZero) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_set();
  export_point_cloud(folder.path() / "cloud.ply", set, context);
  PlyFile const ply = read_ply(folder.path() / "cloud.ply");
  PlyElement const& vertex = *ply.find("vertex");
  std::size_t at = 0, unit = 0;
  for (View const& view : set.views)
    for (std::size_t i = 0; i < view.image.count_depths(); ++i, ++at) {
      Vector3d const n(vertex.find("nx")->values[at], vertex.find("ny")->values[at], vertex.find("nz")->values[at]);
      if (n.isZero()) continue;
      Vector3d const p(vertex.find("x")->values[at], vertex.find("y")->values[at], vertex.find("z")->values[at]);
      EXPECT_NEAR(n.norm(), 1, 1e-5);
      EXPECT_GT(n.dot(view.eye() - p), 0);
      ++unit;
    }
  EXPECT_GT(unit, vertex.rows * 9 / 10);
}

TEST(ExportPointCloud, ColoursCarryTheGainInLinearLight) {
  TemporaryFolder folder;
  Context context;
  ScanSet set = make_set();
  set.views.resize(1);
  set.views[0].image.color.setTo(cv::Scalar(100, 100, 100));
  set.views[0].gain = {2, 1, 100};
  export_point_cloud(folder.path() / "cloud.ply", set, context);
  PlyFile const ply = read_ply(folder.path() / "cloud.ply");
  // ((100/255 + 0.055)/1.055)^2.4 = 0.12744; doubled and encoded: 0.54269 * 255 = 138.4.
  EXPECT_EQ(ply.find("vertex")->find("red")->values[0], 138);
  EXPECT_EQ(ply.find("vertex")->find("green")->values[0], 100);
  EXPECT_EQ(ply.find("vertex")->find("blue")->values[0], 255);
}

TEST(ExportColmap, CamerasAndPosesProjectThePointsWhereTheyWereSeen) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_set();
  fs::path const out = folder.path() / "model";
  export_colmap(out, set, context);
  auto const cameras = read_table(out / "sparse" / "cameras.txt"), images = read_table(out / "sparse" / "images.txt"),
             points = read_table(out / "sparse" / "points3D.txt");
  ASSERT_EQ(cameras.size(), 2u);
  ASSERT_EQ(images.size(), 4u);                     // two lines an image
  ASSERT_EQ(points.size(), points_of(set).size());  // few enough to be all there
  for (std::size_t v = 0; v < 2; ++v) {
    auto const& camera = cameras[v];
    auto const& image = images[2 * v];
    auto const& observations = images[2 * v + 1];
    EXPECT_EQ(camera[1], "PINHOLE");
    EXPECT_EQ(image[0], std::to_string(v + 1));
    EXPECT_EQ(image[8], camera[0]);
    EXPECT_EQ(image[9], set.views[v].name + ".png");
    auto const number = [&](int i) { return std::stod(image[i]); };
    Eigen::Quaterniond const q(number(1), number(2), number(3), number(4));
    EXPECT_NEAR(q.norm(), 1, 1e-12);
    Vector3d const t(number(5), number(6), number(7));
    std::size_t index = 0;
    for (auto const& point : points) {
      if (point[8] != image[0]) continue;
      EXPECT_EQ(std::stoul(point[9]), index);
      Vector3d const p = q * Vector3d(std::stod(point[1]), std::stod(point[2]), std::stod(point[3])) + t;
      double const u = std::stod(camera[4]) * p.x() / p.z() + std::stod(camera[6]);
      double const w = std::stod(camera[5]) * p.y() / p.z() + std::stod(camera[7]);
      EXPECT_NEAR(u, std::stod(observations[3 * index]), 1e-9);
      EXPECT_NEAR(w, std::stod(observations[3 * index + 1]), 1e-9);
      EXPECT_EQ(observations[3 * index + 2], point[0]);
      ++index;
    }
    EXPECT_EQ(observations.size(), 3 * index);
    EXPECT_EQ(index, set.views[v].image.count_depths());
  }
}

TEST(ExportColmap, DepthMapsAndPicturesAreExact) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_set();
  fs::path const out = folder.path() / "model";
  export_colmap(out, set, context);
  for (View const& view : set.views) {
    std::string const bytes = read_file(out / "stereo" / "depth_maps" / (view.name + ".png.geometric.bin"));
    cv::Mat1f const& depth = view.image.depth;
    std::string const header = std::to_string(depth.cols) + "&" + std::to_string(depth.rows) + "&1&";
    ASSERT_TRUE(bytes.starts_with(header));
    ASSERT_EQ(bytes.size(), header.size() + depth.total() * sizeof(float));
    for (int y = 0; y < depth.rows; ++y)
      for (int x = 0; x < depth.cols; ++x) {
        float value;
        std::memcpy(&value, bytes.data() + header.size() + sizeof(float) * (y * depth.cols + x), sizeof(float));
        EXPECT_EQ(value, view.image.has_depth(x, y) ? depth(y, x) : 0.0f);
      }
    cv::Mat3b const color = read_color(out / "images" / (view.name + ".png"));
    EXPECT_EQ(std::memcmp(color.data, view.image.color.data, color.total() * 3), 0);
  }
}

TEST(ExportColmap, EqualCamerasAreWrittenOnce) {
  TemporaryFolder folder;
  Context context;
  ScanSet set = make_set();
  set.views[1] = make_view("left", set.views[0].image.camera, *set.views[1].object_from_camera);
  export_colmap(folder.path() / "model", set, context);
  EXPECT_EQ(read_table(folder.path() / "model" / "sparse" / "cameras.txt").size(), 1u);
}

TEST(ExportNerfstudio, DepthIsWithinHalfAStepAndTheStepIsAsFineAsItCanBe) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_set();
  fs::path const out = folder.path() / "nerf";
  export_nerfstudio(out, set, context);
  Json const json = read_json(out / "transforms.json");
  double const step = json["depth_unit_scale_factor"];
  double const greatest = 200 + 0.5 * 39 + 0.25 * 29;
  EXPECT_GE(step * 65535, greatest);
  EXPECT_LE(step * 65535, greatest * 1.1);  // two digits
  EXPECT_EQ(json["unit"], "mm");
  ASSERT_EQ(json["frames"].size(), 2u);
  for (std::size_t v = 0; v < 2; ++v) {
    RangeImage const& image = set.views[v].image;
    Json const& frame = json["frames"][v];
    cv::Mat const depth = read_image(out / frame["depth_file_path"].get<std::string>());
    cv::Mat const mask = read_image(out / frame["mask_path"].get<std::string>());
    ASSERT_EQ(depth.type(), CV_16UC1);
    ASSERT_EQ(mask.type(), CV_8UC1);
    for (int y = 0; y < depth.rows; ++y)
      for (int x = 0; x < depth.cols; ++x) {
        EXPECT_EQ(depth.at<ushort>(y, x) != 0, image.has_depth(x, y));
        if (image.has_depth(x, y)) {
          EXPECT_NEAR(depth.at<ushort>(y, x) * step, image.depth(y, x), 0.5001 * step);
        }
        EXPECT_EQ(mask.at<uchar>(y, x), x >= 4 && y >= 3 ? 255 : 0);  // the hole is a part of the object
      }
  }
}

TEST(ExportNerfstudio, CamerasLookAlongMinusZWithPixelCentresAtHalves) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_set();
  export_nerfstudio(folder.path() / "nerf", set, context);
  Json const json = read_json(folder.path() / "nerf" / "transforms.json");
  for (std::size_t v = 0; v < 2; ++v) {
    Json const& frame = json["frames"][v];
    Eigen::Matrix4d world_from_gl;
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c) world_from_gl(r, c) = frame["transform_matrix"][r][c];
    View const& view = set.views[v];
    EXPECT_EQ(frame["w"], view.image.camera.width());
    int const x = 10, y = 20;
    double const z = view.image.depth(y, x);
    double const right = (x + 0.5 - frame["cx"].get<double>()) / frame["fl_x"].get<double>() * z;
    double const down = (y + 0.5 - frame["cy"].get<double>()) / frame["fl_y"].get<double>() * z;
    Vector3d const p = (world_from_gl * Eigen::Vector4d(right, -down, -z, 1)).head<3>();
    EXPECT_LT((p - *view.object_from_camera * view.image.point(x, y)).norm(), 1e-9);
  }
}

TEST(ExportNerfstudio, EqualIntrinsicsStandOnceAtTheTop) {
  TemporaryFolder folder;
  Context context;
  ScanSet set = make_set();
  set.views.resize(1);
  export_nerfstudio(folder.path() / "nerf", set, context);
  Json const json = read_json(folder.path() / "nerf" / "transforms.json");
  EXPECT_EQ(json["fl_x"], 50);
  EXPECT_FALSE(json["frames"][0].contains("fl_x"));
}

TEST(Export, SameBytesForAnyNumberOfThreads) {
  TemporaryFolder folder;
  ScanSet const set = make_set();
  for (int threads : {1, 4}) {
    Context context;
    context.threads = threads;
    fs::path const out = folder.path() / std::to_string(threads);
    fs::create_directory(out);
    export_point_cloud(out / "cloud.ply", set, context);
    export_colmap(out / "colmap", set, context);
    export_nerfstudio(out / "nerf", set, context);
  }
  std::size_t files = 0;
  for (auto const& entry : fs::recursive_directory_iterator(folder.path() / "1")) {
    if (!entry.is_regular_file()) continue;
    EXPECT_EQ(hash_file(entry.path()),
              hash_file(folder.path() / "4" / fs::relative(entry.path(), folder.path() / "1")));
    ++files;
  }
  EXPECT_EQ(files, 1u + 7u + 7u);
}

TEST(Export, ASetWithoutAnyDepthIsStillWritten) {
  TemporaryFolder folder;
  Context context;
  ScanSet set = make_set();
  for (View& view : set.views) {
    view.image.depth.setTo(kMissing);
    view.image.sigma.setTo(kMissing);
    view.image.classes.setTo(static_cast<int>(PixelClass::no_depth));
  }
  export_point_cloud(folder.path() / "cloud.ply", set, context);
  EXPECT_EQ(read_ply(folder.path() / "cloud.ply").find("vertex")->rows, 0u);
  export_colmap(folder.path() / "colmap", set, context);
  EXPECT_TRUE(read_table(folder.path() / "colmap" / "sparse" / "points3D.txt").empty());
  export_nerfstudio(folder.path() / "nerf", set, context);
  EXPECT_TRUE(fs::exists(folder.path() / "nerf" / "transforms.json"));
}

TEST(Export, WhatCannotBeExportedIsRefusedByNameAndLeavesNothing) {
  TemporaryFolder folder;
  Context context;
  fs::path const out = folder.path() / "out";
  ScanSet flat = make_set();
  flat.views.push_back(make_view("flat", Camera::orthographic(40, 30, 1, 1, 20, 15), Isometry3d::Identity()));
  EXPECT_SCANVIEW_ERROR(export_colmap(out, flat, context), ErrorCode::bad_input, "flat: its camera is orthographic");
  EXPECT_SCANVIEW_ERROR(export_nerfstudio(out, flat, context), ErrorCode::bad_input,
                        "flat: its camera is orthographic");
  ScanSet lost = make_set();
  lost.views[1].object_from_camera.reset();
  EXPECT_SCANVIEW_ERROR(export_colmap(out, lost, context), ErrorCode::bad_input, "left: it has no pose");
  EXPECT_SCANVIEW_ERROR(export_point_cloud(out, lost, context), ErrorCode::bad_input, "left: it has no pose");
  ScanSet gray = make_set();
  gray.views[0].image.color.release();
  EXPECT_SCANVIEW_ERROR(export_nerfstudio(out, gray, context), ErrorCode::bad_input, "000: it has no colour");
  EXPECT_SCANVIEW_ERROR(export_point_cloud(out, {}, context), ErrorCode::bad_input, "no views");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

TEST(Export, ReplacesAnEarlierExportButNoOtherFolder) {
  TemporaryFolder folder;
  Context context;
  ScanSet set = make_set();
  for (auto const& [name, run] : {std::pair("colmap", &export_colmap), std::pair("nerf", &export_nerfstudio)}) {
    fs::path const out = folder.path() / name;
    fs::create_directory(out);
    set = make_set();
    run(out, set, context);  // into an empty folder
    set.views.resize(1);
    run(out, set, context);
    EXPECT_FALSE(fs::exists(out / "images" / "left.png"));
  }
  fs::path const precious = folder.path() / "precious";
  fs::create_directory(precious);
  std::ofstream(precious / "thesis.txt") << "years of work";
  EXPECT_SCANVIEW_ERROR(export_colmap(precious, set, context), ErrorCode::bad_input, "precious");
  EXPECT_SCANVIEW_ERROR(export_nerfstudio(precious, set, context), ErrorCode::bad_input, "precious");
  EXPECT_TRUE(fs::exists(precious / "thesis.txt"));
}

TEST(Export, AnUnwritablePlaceIsAnErrorAndLeavesNothing) {
  TemporaryFolder folder;
  Context context;
  std::ofstream(folder.path() / "file") << "in the way";
  ScanSet const set = make_set();
  EXPECT_SCANVIEW_ERROR(export_colmap(folder.path() / "file" / "model", set, context), ErrorCode::io, "model");
  EXPECT_SCANVIEW_ERROR(export_nerfstudio(folder.path() / "file" / "nerf", set, context), ErrorCode::io, "nerf");
  EXPECT_SCANVIEW_ERROR(export_point_cloud(folder.path() / "file" / "a.ply", set, context), ErrorCode::io, "a.ply");
}

TEST(Export, CancellingLeavesNothing) {
  TemporaryFolder folder;
  std::atomic<bool> const cancelled = true;
  Context context;
  context.cancelled = &cancelled;
  EXPECT_SCANVIEW_ERROR(export_colmap(folder.path() / "model", make_set(), context), ErrorCode::interrupted, "");
  EXPECT_TRUE(fs::is_empty(folder.path()));
}

}  // namespace
}  // namespace scanview
