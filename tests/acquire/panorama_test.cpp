#include "acquire/panorama.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <utility>

#include "acquire/scan_set_file.h"
#include "base/image_file.h"
#include "base/random.h"
#include "tests/acquire/import_fixture.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using std::numbers::pi;

constexpr int kWidth = 512, kHeight = 256;
constexpr double kStep = 2 * pi / kWidth;  // between samples, rad
constexpr double kUnit = 0.001;

/// A box about the origin, in the panorama's frame: where a ray meets it, and on which face (cube_side_name's order).
struct Met {
  double length;
  int face;
};
Met meet_room(Vector3d const& direction) {
  Vector3d const low(-2, -1.2, -4), high(3, 1.8, 2.5);
  Met met{1e9, -1};
  for (int axis = 0; axis < 3; ++axis) {
    double const wall = direction[axis] > 0 ? high[axis] : low[axis];
    double const length = direction[axis] == 0 ? 1e9 : wall / direction[axis];
    if (length < met.length) met = {length, 2 * axis + (direction[axis] < 0)};
  }
  return met;
}

cv::Vec3b const kFaceColors[kCubeSides] = {{10, 20, 200},  {20, 200, 10},  {200, 10, 20},
                                           {10, 200, 200}, {200, 200, 10}, {200, 10, 200}};
cv::Vec3b const kLeft(255, 255, 255), kRight(0, 0, 0);  // on the upper part of the face at -z

/// As the header has it.
Vector3d panorama_direction(double u, double v) {
  double const a = 2 * pi * ((u + 0.5) / kWidth - 0.5), b = pi * (0.5 - (v + 0.5) / kHeight);
  return {std::cos(b) * std::sin(a), std::sin(b), -std::cos(b) * std::cos(a)};
}

struct RoomPictures {
  cv::Mat3b color = cv::Mat3b(kHeight, kWidth);
  cv::Mat1w depth = cv::Mat1w(kHeight, kWidth);
};
RoomPictures room_pictures() {
  RoomPictures room;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) {
      Vector3d const direction = panorama_direction(x, y);
      Met const met = meet_room(direction);
      room.depth(y, x) = static_cast<std::uint16_t>(std::lround(met.length / kUnit));
      room.color(y, x) = kFaceColors[met.face];
      if (met.face == 5 && direction.y() > 0) room.color(y, x) = direction.x() < 0 ? kLeft : kRight;
    }
  return room;
}

Json write_room(fs::path const& folder, RoomPictures const& room = room_pictures()) {
  write_picture(folder / "a.png", room.color);
  write_picture(folder / "a_depth.png", room.depth);
  Json const json{
      {"format", 1}, {"unit", "m"}, {"nodes", Json::array({{{"color", "a.png"}, {"depth", "a_depth.png"}}})}};
  write_json(folder / "panoramas.json", json);
  return json;
}

CapturedNode read_node(fs::path const& folder, int size = 0) {
  Context context;
  return PanoramaReader(folder).read(0, size, context);
}

/// Whether all directions within two samples of this one meet the same face.
bool is_amid_a_face(Vector3d const& direction) {
  int const face = meet_room(direction).face;
  for (int axis = 0; axis < 3; ++axis)
    for (double const sign : {-1, 1})
      if (meet_room((direction + sign * 2 * kStep * Vector3d::Unit(axis)).normalized()).face != face) return false;
  return true;
}

TEST(Panorama, PlanesStayPlanesToWithinTheRoundingOfTheirSamples) {
  TemporaryFolder folder;
  Json json = write_room(folder.path());
  Eigen::Isometry3d const pose = some_pose();
  json["nodes"][0]["scene_from_panorama"] = pose_to_json(pose);
  json["nodes"][0]["name"] = "hall";
  write_json(folder.path() / "panoramas.json", json);
  CapturedNode const node = read_node(folder.path());
  EXPECT_EQ(node.name, "hall");
  EXPECT_EQ((node.position - pose.translation()).norm(), 0);
  ASSERT_EQ(node.sides.size(), static_cast<std::size_t>(kCubeSides));
  int amid = 0;
  for (View const& side : node.sides) {
    RangeImage const& image = side.image;
    ASSERT_EQ(image.camera.width(), kWidth / 4);
    for (int y = 0; y < image.depth.rows; ++y)
      for (int x = 0; x < image.depth.cols; ++x) {
        ASSERT_TRUE(image.has_depth(x, y)) << side.name << " " << x << " " << y;
        Vector3d const p = pose.inverse() * (*side.object_from_camera * image.point(x, y));
        Met const met = meet_room(p.normalized());
        double const error = std::abs(p.norm() - met.length);
        // Amid a face only rounding is left: the three samples' lengths are within a few per cent of the ray's, and of
        // each other. At an edge of the room a chord cuts it off.
        if (is_amid_a_face(p.normalized())) {
          ++amid;
          EXPECT_LT(error, 0.5 * kUnit * 1.15 + 1e-5) << side.name << " " << x << " " << y;
        } else {
          EXPECT_LT(error, 2 * kStep * met.length) << side.name << " " << x << " " << y;
        }
        EXPECT_NEAR(image.sigma(y, x), kUnit / std::sqrt(12) * image.depth(y, x) / p.norm(), 1e-7);
      }
  }
  EXPECT_GT(amid, 6 * 128 * 128 * 3 / 4);
}

TEST(Panorama, ColorsAreOnTheirSidesAndNotMirrored) {
  TemporaryFolder folder;
  write_room(folder.path());
  CapturedNode const node = read_node(folder.path(), 64);
  for (int side = 0; side < kCubeSides; ++side) {
    EXPECT_EQ(node.sides[side].name, cube_side_name(side));
    EXPECT_EQ(node.sides[side].image.color(40, 32), kFaceColors[side]) << cube_side_name(side);
  }
  cv::Mat3b const front = node.sides[5].image.color;  // looks along -z, as the picture's centre does
  EXPECT_EQ(front(28, 28), kLeft);
  EXPECT_EQ(front(28, 36), kRight);
}

TEST(Panorama, AFinePictureIsAveragedInLinearLight) {
  Panorama panorama;
  panorama.color = cv::Mat3b(kHeight, kWidth);
  panorama.ray = cv::Mat1f(kHeight, kWidth, 2.0F);
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) panorama.color(y, x) = cv::Vec3b::all((x + y) % 2 ? 255 : 0);
  RangeImage const image = resample_panorama(panorama, Eigen::Matrix3d::Identity(), 5, 16);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x) EXPECT_NEAR(image.color(y, x)[1], 188, 3);  // half the light, in sRGB
}

TEST(Panorama, NothingIsMixedAcrossADepthStep) {
  Panorama panorama;
  panorama.color = cv::Mat3b(kHeight, kWidth, cv::Vec3b::all(9));
  panorama.ray = cv::Mat1f(kHeight, kWidth, 3.0F);
  panorama.ray(cv::Rect(200, 100, 111, 61)) = 1.0F;
  for (int side = 0; side < kCubeSides; ++side) {
    RangeImage const image = resample_panorama(panorama, Eigen::Matrix3d::Identity(), side, 200);
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 200; ++x) {
        double const r = image.point(x, y).norm();
        EXPECT_LT(std::min(std::abs(r - 1), std::abs(r - 3)), 3 * kStep * kStep) << side << " " << x << " " << y;
      }
  }
}

TEST(Panorama, AFloorFarAwayIsNoStaircase) {
  Panorama panorama;
  panorama.color = cv::Mat3b(kHeight, kWidth, cv::Vec3b::all(9));
  panorama.ray = cv::Mat1f(kHeight, kWidth, std::numeric_limits<float>::infinity());
  constexpr double kEye = 1.5;
  for (int y = kHeight / 2; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x) panorama.ray(y, x) = static_cast<float>(-kEye / panorama_direction(x, y).y());
  RangeImage const image = resample_panorama(panorama, Eigen::Matrix3d::Identity(), 5, 128);
  int steep = 0;
  for (int y = 0; y < 128; ++y)
    for (int x = 0; x < 128; ++x) {
      if (!image.has_depth(x, y)) continue;
      Vector3d const p = image.point(x, y);
      double const elevation = std::atan2(p.y(), std::hypot(p.x(), p.z()));
      if (elevation < 5 * kStep) continue;  // the last rows before the sky
      EXPECT_NEAR(p.y(), kEye, 1e-4) << x << " " << y;
      steep += elevation < 10 * pi / 180;
    }
  EXPECT_GT(steep, 500);
}

TEST(Panorama, SkyIsBackgroundAndMissingHasNoDepth) {
  TemporaryFolder folder;
  RoomPictures room = room_pictures();
  room.depth.rowRange(0, 60) = 65535;
  room.depth(cv::Rect(0, 100, 40, 50)) = 0;  // about the seam of the picture: +z
  room.depth(cv::Rect(kWidth - 40, 100, 40, 50)) = 777;
  Json json = write_room(folder.path(), room);
  json["nodes"][0]["sky"] = {65535};
  json["nodes"][0]["missing"] = {777};  // 0 is never a depth
  write_json(folder.path() / "panoramas.json", json);
  CapturedNode const node = read_node(folder.path());
  auto const class_of = [&](int side, int x, int y) {
    return static_cast<PixelClass>(node.sides[side].image.classes(y, x));
  };
  EXPECT_EQ(class_of(2, 64, 64), PixelClass::background);
  EXPECT_EQ(class_of(4, 60, 64), PixelClass::no_depth);
  EXPECT_EQ(class_of(4, 68, 64), PixelClass::no_depth);
  EXPECT_EQ(class_of(5, 64, 64), PixelClass::object);
  EXPECT_EQ(class_of(3, 64, 64), PixelClass::object);
  EXPECT_EQ(node.sides[4].image.color(64, 64), kFaceColors[4]);
}

TEST(Panorama, ExrRaysAreReadWithInfinityAsSky) {
  TemporaryFolder folder;
  Json json = write_room(folder.path());
  cv::Mat1f rays(kHeight / 2, kWidth / 2, 4.0F);  // another size than the colour's
  rays.rowRange(0, 20) = std::numeric_limits<float>::infinity();
  rays.rowRange(100, 128) = kMissing;
  write_depth_exr(folder.path() / "a.exr", rays);
  json["nodes"][0]["depth"] = "a.exr";
  json["nodes"][0]["depth_unit"] = 0.5;
  write_json(folder.path() / "panoramas.json", json);
  CapturedNode const node = read_node(folder.path());
  EXPECT_EQ(node.sides[2].image.classes(64, 64), static_cast<std::uint8_t>(PixelClass::background));
  EXPECT_EQ(node.sides[3].image.classes(64, 64), static_cast<std::uint8_t>(PixelClass::no_depth));
  EXPECT_NEAR(node.sides[0].image.point(10, 64).norm(), 2, 1e-3);
  json["nodes"][0]["sky"] = {0};
  write_json(folder.path() / "panoramas.json", json);
  EXPECT_SCANVIEW_ERROR(PanoramaReader(folder.path()), ErrorCode::bad_input, "'sky'");
}

TEST(Panorama, WhateverTheRaysEveryDepthIsSound) {
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    SCOPED_TRACE(seed);
    CounterRandom random(seed, 0);
    Panorama panorama;
    int const height = 2 + static_cast<int>(random.below(12));
    panorama.color = cv::Mat3b(height, 2 * height, cv::Vec3b::all(100));
    panorama.ray = cv::Mat1f(height, 2 * height);
    double const spread = 20 * random.uniform() * random.uniform();
    for (float& ray : panorama.ray) {
      ray = static_cast<float>(std::exp(spread * random.normal()));
      if (random.uniform() < 0.1) ray = kMissing;
      if (random.uniform() < 0.1) ray = std::numeric_limits<float>::infinity();
      if (!(ray > 0)) ray = kMissing;
    }
    for (int side = 0; side < kCubeSides; ++side)
      EXPECT_NO_THROW(resample_panorama(panorama, some_pose().linear(), side, 24).check());
  }
}

TEST(Panorama, ThreadsDoNotMatter) {
  TemporaryFolder folder;
  write_room(folder.path());
  Context one, many;
  one.threads = 1;
  PanoramaReader const reader(folder.path());
  CapturedNode const a = reader.read(0, 40, one), b = reader.read(0, 40, many);
  for (int side = 0; side < kCubeSides; ++side) {
    EXPECT_EQ(cv::norm(a.sides[side].image.depth, b.sides[side].image.depth, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(a.sides[side].image.color, b.sides[side].image.color, cv::NORM_INF), 0);
  }
}

TEST(Panorama, BadManifestsAreNamed) {
  TemporaryFolder folder;
  Json const good = write_room(folder.path());
  auto const read = [&](auto change) {
    Json json = good;
    change(json);
    write_json(folder.path() / "panoramas.json", json);
    PanoramaReader{folder.path()};
  };
  ErrorCode const bad = ErrorCode::bad_input;
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["colour"] = 1; }), bad, "'colour'");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["nodes"][0]["depth_kind"] = "z"; }), bad, "'depth_kind'");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["format"] = 2; }), bad, "'format'");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["unit"] = "furlong"; }), bad, "furlong");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j.erase("unit"); }), bad, "'unit' is missing");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["nodes"] = Json::array(); }), bad, "'nodes'");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["nodes"][0].erase("depth"); }), bad, "'depth' is missing");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["nodes"][0]["depth_unit"] = 0; }), bad, "'depth_unit'");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["nodes"][0]["missing"] = {65536}; }), bad, "'missing'");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) { j["nodes"][0]["name"] = "../a"; }), bad, "../a");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) {
                          j["nodes"][0]["scene_from_panorama"] = {1, 2};
                        }),
                        bad, "scene_from_panorama");
  EXPECT_SCANVIEW_ERROR(read([](Json& j) {
                          j["nodes"].push_back(j["nodes"][0]);
                          j["nodes"][1]["name"] = "000";
                        }),
                        bad, "two nodes");
  EXPECT_SCANVIEW_ERROR(PanoramaReader(folder.path() / "nowhere"), bad, "nowhere");
}

TEST(Panorama, BadPicturesAreNamed) {
  TemporaryFolder folder;
  write_room(folder.path());
  fs::path const color = folder.path() / "a.png", depth = folder.path() / "a_depth.png";
  ErrorCode const bad = ErrorCode::bad_input;
  std::string const bytes = read_file(depth);
  for (std::size_t const length : {std::size_t{0}, bytes.size() / 2, bytes.size() - 1}) {
    write_file(depth, bytes.substr(0, length));
    EXPECT_SCANVIEW_ERROR(read_node(folder.path()), bad, "a_depth.png");
  }
  write_picture(depth, cv::Mat1b(kHeight, kWidth, std::uint8_t{3}));
  EXPECT_SCANVIEW_ERROR(read_node(folder.path()), bad, "16 bits");
  write_picture(depth, cv::Mat1w(kHeight, kWidth - 2, std::uint16_t{3}));
  EXPECT_SCANVIEW_ERROR(read_node(folder.path()), bad, "a_depth.png: the picture is 510x256");
  write_picture(color, cv::Mat3b(kHeight, kHeight));
  EXPECT_SCANVIEW_ERROR(read_node(folder.path()), bad, "twice as wide");
  fs::remove(color);
  EXPECT_SCANVIEW_ERROR(read_node(folder.path()), bad, "a.png");
}

}  // namespace
}  // namespace scanview
