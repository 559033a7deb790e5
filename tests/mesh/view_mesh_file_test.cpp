#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "mesh/view_mesh.h"
#include "tests/mesh/depth_maps.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using namespace testing;

class ViewMeshFile : public ::testing::Test {
 protected:
  ViewMeshFile() {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("scanview_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
    Context context;
    camera_ = small_camera();
    mesh_ = mesh_range_image(depth_map(camera_, 1e-3,
                                       [&](int x, int y) {
                                         return sphere_depth(camera_, {0, 0, 3}, 1, x, y);
                                       }),
                             {}, context)
                .view_mesh;
    write_view_mesh(folder_, mesh_);
  }
  ~ViewMeshFile() override { fs::remove_all(folder_); }

  void expect_refused(Camera const& camera, std::string const& file) {
    try {
      read_view_mesh(folder_, camera);
      ADD_FAILURE() << "accepted";
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input);
      EXPECT_EQ(error.path(), folder_ / file) << error.what();
    }
  }
  void replace(std::string const& from, std::string const& to) {
    std::string bytes = read_file(folder_ / "mesh.ply");
    auto const at = bytes.find(from);
    ASSERT_NE(at, std::string::npos);
    write_file(folder_ / "mesh.ply", bytes.replace(at, from.size(), to));
  }

  fs::path folder_;
  Camera camera_;
  ViewMesh mesh_;
};

TEST_F(ViewMeshFile, RoundTripIsExact) {
  ViewMesh const read = read_view_mesh(folder_, camera_);
  EXPECT_EQ(read.camera, camera_);
  EXPECT_EQ(read.mesh.vertices, mesh_.mesh.vertices);
  EXPECT_EQ(read.mesh.triangles, mesh_.mesh.triangles);
  EXPECT_EQ(read.cos_phi, mesh_.cos_phi);
  EXPECT_EQ(cv::countNonZero(read.feather != mesh_.feather), 0);
  EXPECT_GT(read.mesh.triangles.size(), 10u);
}

TEST_F(ViewMeshFile, AnEmptyMeshRoundTrips) {
  mesh_.mesh = {};
  mesh_.cos_phi.clear();
  write_view_mesh(folder_, mesh_);
  EXPECT_TRUE(read_view_mesh(folder_, camera_).mesh.triangles.empty());
}

TEST_F(ViewMeshFile, AMissingCosineIsRefused) {
  replace("float cos", "float cos2");
  expect_refused(camera_, "mesh.ply");
}

TEST_F(ViewMeshFile, WhatIsNoCosineIsRefused) {
  std::string bytes = read_file(folder_ / "mesh.ply");
  bytes[bytes.size() - 1] = 0x41;  // the last float is about 8 or more
  write_file(folder_ / "mesh.ply", bytes);
  expect_refused(camera_, "mesh.ply");
}

TEST_F(ViewMeshFile, AnIndexOutOfRangeIsRefused) {
  std::string bytes = read_file(folder_ / "mesh.ply");
  bytes[bytes.size() - 5] = 0x7f;  // the last triangle's last index
  write_file(folder_ / "mesh.ply", bytes);
  expect_refused(camera_, "mesh.ply");
}

TEST_F(ViewMeshFile, TruncatedFilesAreRefused) {
  std::string const bytes = read_file(folder_ / "mesh.ply");
  for (std::size_t n : {std::size_t(0), std::size_t(100), bytes.size() / 2, bytes.size() - 1}) {
    write_file(folder_ / "mesh.ply", bytes.substr(0, n));
    expect_refused(camera_, "mesh.ply");
  }
}

TEST_F(ViewMeshFile, FeatherOfAnotherSizeIsRefused) {
  expect_refused(small_camera(97, 80), "feather.png");
  write_file(folder_ / "feather.png", encode_png(cv::Mat3b(80, 96, cv::Vec3b(1, 2, 3))));
  expect_refused(camera_, "feather.png");
}

TEST_F(ViewMeshFile, VerticesBehindThePerspectiveCameraAreRefused) {
  mesh_.mesh.vertices[0].z() = -1;
  write_view_mesh(folder_, mesh_);
  expect_refused(camera_, "mesh.ply");
}

}  // namespace
}  // namespace scanview
