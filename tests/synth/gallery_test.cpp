#include "synth/gallery.h"

#include <gtest/gtest.h>

#include <vector>

#include "synth/gallery_building.h"
#include "synth/model_camera.h"
#include "synth/scanner.h"
#include "tests/expect_error.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

using Eigen::Vector3d;

ModelCamera camera_in(std::size_t polygons, Context& context) {
  ModelCameraOptions options;
  options.light = ModelCameraOptions::Light::painted;
  return ModelCamera(make_gallery(polygons), options, context);
}

TEST(Gallery, HasTheNumberOfTrianglesThatIsAskedFor) {
  for (std::size_t const polygons : {20'000ul, 30'000ul, 50'000ul, 100'000ul, 300'000ul, 1'000'000ul, 3'000'000ul}) {
    TriangleMesh const mesh = make_gallery(polygons);
    mesh.check();
    auto const count = static_cast<double>(mesh.triangles.size()), wanted = static_cast<double>(polygons);
    EXPECT_NEAR(count, wanted, 0.1 * wanted);
    EXPECT_EQ(mesh.colors.size(), mesh.vertices.size());
  }
  EXPECT_SCANVIEW_ERROR(make_gallery(kGalleryLeast - 1), ErrorCode::usage, "19999");
  EXPECT_SCANVIEW_ERROR(make_gallery(kGalleryMost + 1), ErrorCode::usage, "10000001");
}

TEST(Gallery, IsClosedAtEveryFineness) {
  for (std::size_t const polygons : {20'000ul, 47'000ul, 100'000ul}) {
    TriangleMesh const mesh = welded(make_gallery(polygons));
    EXPECT_TRUE(is_closed(mesh)) << polygons;
    for (auto const& t : mesh.triangles) EXPECT_TRUE(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
  }
}

TEST(Gallery, KeepsItsShapeWhateverTheNumberOfTriangles) {
  double const coarse = signed_volume(make_gallery(50'000)), fine = signed_volume(make_gallery(500'000));
  EXPECT_NEAR(coarse, fine, 1e-3 * fine);
  Eigen::AlignedBox3f box;
  for (auto const& vertex : make_gallery(50'000).vertices) box.extend(vertex);
  EXPECT_EQ(box.max().x(), 25.6f);
  EXPECT_EQ(box.max().z(), 17.2f);
}

TEST(Gallery, ColoursChangeAtTheSamePlacesWhateverTheNumberOfTriangles) {
  Context context;
  ModelCamera coarse = camera_in(60'000, context), fine = camera_in(600'000, context);
  Camera const lens = cube_side_camera(200);
  int differing = 0;
  for (int side = 0; side < kCubeSides; ++side) {
    auto const pose = scene_from_cube_side(side, room_corner(0, 0) + Vector3d(6, 1.6, 3));
    cv::Mat3b const a = coarse.picture(lens, pose, context), b = fine.picture(lens, pose, context);
    for (int y = 0; y < 200; ++y)
      for (int x = 0; x < 200; ++x) differing += cv::norm(a(y, x), b(y, x), cv::NORM_INF) > 8;
  }
  EXPECT_LT(differing, 6 * 200 * 200 / 200) << "only at the outlines of round things";
}

TEST(Gallery, NoBacksAreSeenFromTheRoomsAndOnlyBacksFromInsideThings) {
  Context context;
  ModelCamera const camera = camera_in(100'000, context);
  Eigen::AlignedBox3d const walk = gallery_walk_box();
  for (int x = 0; x < kRoomsX; ++x)
    for (int z = 0; z < kRoomsZ; ++z) {
      Vector3d const middle = room_corner(x, z) + Vector3d(4.6, 1.6, 3.4);
      EXPECT_TRUE(walk.contains(middle));
      EXPECT_EQ(camera.share_of_backs(middle), 0) << x << " " << z;
      EXPECT_GT(camera.clearance(middle), 0.5) << x << " " << z;
    }
  std::vector<Vector3d> const inside = {{0.2, 1.6, 8.6},  // walls
                                        {8.6, 2, 1.2},
                                        {12.8, -0.2, 4.4},                             // the floor
                                        room_corner(2, 0) + Vector3d(1.5, 2, 4.4),     // a column
                                        room_corner(0, 0) + Vector3d(3.4, 1.34, 4.2),  // a sphere
                                        room_corner(0, 0) + Vector3d(3.4, 0.4, 4.2)};  // its plinth
  for (Vector3d const& position : inside)
    EXPECT_GT(camera.share_of_backs(position), 0.8) << position.transpose();  // what is sunk in them shows its front
}

TEST(Gallery, DoorwaysArePassable) {
  Context context;
  ModelCamera const camera = camera_in(100'000, context);
  auto const expect_passable = [&](Vector3d const& from, Vector3d const& to) {
    for (int i = 0; i <= 10; ++i) {
      Vector3d const at = from + (to - from) * i / 10;
      EXPECT_GT(camera.clearance(at), 0.7) << at.transpose();
      EXPECT_EQ(camera.share_of_backs(at), 0) << at.transpose();
    }
  };
  for (int z = 0; z < kRoomsZ; ++z)
    for (int x = 0; x + 1 < kRoomsX; ++x) {
      Vector3d const middle = room_corner(x + 1, z) + Vector3d(-0.5 * kWall, 1.6, kTile * (kDoorZ + 1));
      expect_passable(middle - Vector3d(0.8, 0, 0), middle + Vector3d(0.8, 0, 0));
    }
  for (int x = 0; x < kRoomsX; ++x) {
    Vector3d const middle = room_corner(x, 1) + Vector3d(kTile * (kDoorX + 1), 1.6, -0.5 * kWall);
    expect_passable(middle - Vector3d(0, 0, 0.8), middle + Vector3d(0, 0, 0.8));
  }
}

TEST(Gallery, RoomsAreLitAndTheSkyIsSeen) {
  Context context;
  ModelCamera camera(make_gallery(30'000), {}, context);
  for (int x = 0; x < kRoomsX; ++x)
    for (int z = 0; z < kRoomsZ; ++z) {
      CapturedNode const node = capture_node(camera, room_corner(x, z) + Vector3d(4.6, 1.6, 3.4), 32, "000", context);
      double sum = 0;
      int sky = 0;
      for (View const& side : node.sides) {
        sum += cv::mean(side.image.color)[1] / kCubeSides;
        for (auto const value : side.image.classes) sky += value == static_cast<uchar>(PixelClass::background);
      }
      EXPECT_GT(sum, 110);
      EXPECT_LT(sum, 220);
      EXPECT_GT(sky, 32 * 32 / 5);
    }
}

TEST(Gallery, IsABuiltInModelOfAnySize) {
  EXPECT_TRUE(is_builtin_model("gallery"));
  EXPECT_TRUE(is_builtin_model("gallery:30000"));
  EXPECT_FALSE(is_builtin_model("gallery.ply"));
  EXPECT_EQ(builtin_model("gallery").triangles.size(), make_gallery(100'000).triangles.size());
  TriangleMesh const a = builtin_model("gallery:30000"), b = make_gallery(30'000);
  EXPECT_EQ(a.vertices, b.vertices) << "always the same";
  EXPECT_EQ(a.triangles, b.triangles);
  for (char const* const bad : {"gallery:", "gallery:x", "gallery:1e5", "gallery:-1", "gallery:30000 "})
    EXPECT_SCANVIEW_ERROR(builtin_model(bad), ErrorCode::usage, "gallery:POLYGONS");
  EXPECT_SCANVIEW_ERROR(builtin_model("gallery:5"), ErrorCode::usage, "20000");
}

}  // namespace
}  // namespace scanview
