#include "register/pose_file.h"

#include <gtest/gtest.h>

#include "base/files.h"
#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

Eigen::Isometry3d pose(double angle, Eigen::Vector3d const& place) {
  return Eigen::Translation3d(place) * Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -1).normalized());
}

/// Two views of the four corners of a square and a point above it, as single pixels with a depth.
ScanSet two_views(Eigen::Isometry3d const& second, Json& marks) {
  Eigen::Vector3d const points[] = {{-0.2, -0.2, 2}, {0.2, -0.2, 2.1}, {0.2, 0.2, 2}, {-0.2, 0.2, 1.9}, {0, 0, 1.8}};
  ScanSet set;
  for (std::size_t v = 0; v < 2; ++v) {
    View view;
    view.name = v == 0 ? "000" : "001";
    view.image = empty_range_image(Camera::perspective(400, 400, 400, 400, 200, 200));
    for (std::size_t i = 0; i < 5; ++i) {
      Eigen::Vector3d const p = v == 0 ? points[i] : Eigen::Vector3d(second.inverse() * points[i]);
      Eigen::Vector2d const pixel = view.image.camera.project(p);
      int const x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
      view.image.depth(y, x) = static_cast<float>(p.z());
      view.image.sigma(y, x) = 1e-3F;
      view.image.classes(y, x) = static_cast<std::uint8_t>(PixelClass::object);
      marks["marks"][view.name]["p" + std::to_string(i)] = {pixel.x(), pixel.y()};
    }
    set.views.push_back(view);
  }
  return set;
}

class PoseFile : public ::testing::Test {
 protected:
  void SetUp() override { set_ = two_views(second_, marks_); }
  std::filesystem::path write(std::string const& name, std::string const& text) {
    write_file(folder_.path() / name, text);
    return folder_.path() / name;
  }
  TemporaryFolder folder_;
  Eigen::Isometry3d const second_ = pose(0.1, {0.05, -0.05, 0.1});
  Json marks_;
  ScanSet set_;
};

TEST_F(PoseFile, TumLinesAreTakenInOrder) {
  read_poses(write("poses.txt", "# stamp tx ty tz qx qy qz qw\n0.1 1 2 3 0 0 0 1\n0.2 0 0 1 0 1 0 0\n"), set_);
  EXPECT_EQ(set_.views[0].object_from_camera->translation(), Eigen::Vector3d(1, 2, 3));
  // Half a turn about y.
  EXPECT_TRUE(set_.views[1].object_from_camera->linear().isApprox(
      Eigen::Vector3d(-1, 1, -1).asDiagonal().toDenseMatrix(), 1e-14));
}

TEST_F(PoseFile, MeshLabAlignmentsGoByName) {
  std::string const rows = "\n#\n1 0 0 5\n0 1 0 6\n0 0 1 7\n0 0 0 1\n";
  read_poses(write("set.aln", "2\n001.ply" + rows + "000.ply\n#\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n0\n"), set_);
  EXPECT_EQ(set_.views[1].object_from_camera->translation(), Eigen::Vector3d(5, 6, 7));
  EXPECT_TRUE(set_.views[0].object_from_camera->isApprox(Eigen::Isometry3d::Identity()));
}

TEST_F(PoseFile, MarksPlaceAView) {
  read_poses(write("marks.json", marks_.dump()), set_);
  EXPECT_TRUE(set_.views[0].object_from_camera->isApprox(Eigen::Isometry3d::Identity()));
  // Depths are floats: 2 is good to 1.2e-7, over a figure 0.4 wide.
  EXPECT_LT((set_.views[1].object_from_camera->matrix() - second_.matrix()).norm(), 1e-5);
}

TEST_F(PoseFile, BadFilesAreNamed) {
  auto const refused = [&](std::string const& name, std::string const& text, std::string const& why) {
    EXPECT_SCANVIEW_ERROR(read_poses(write(name, text), set_), ErrorCode::bad_input, why);
  };
  refused("few.txt", "0 0 0 0 0 0 0 1\n", "has 1 poses for 2 views");
  refused("bad.txt", "0 0 0 0 0 0 0 2\n0 0 0 0 0 0 0 1\n", "no rigid motion");
  refused("nan.txt", "0 nan 0 0 0 0 0 1\n", "is not 'stamp");
  refused("cut.aln", "2\n000.ply\n#\n1 0 0", "has no 16 numbers");
  refused("other.aln", "1\nother.ply\n#\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", "no pose of view 000");
  Json few = marks_;
  for (char const* name : {"p0", "p1", "p2"}) few["marks"]["001"].erase(name);
  refused("few.json", few.dump(), "fewer than three marks");
  Json outside = marks_;
  outside["marks"]["000"]["p0"] = {-50, 10};
  refused("outside.json", outside.dump(), "outside the picture");
  Json empty = marks_;
  empty["marks"]["000"]["p0"] = {3, 3};
  refused("empty.json", empty.dump(), "has no depth");
}

}  // namespace
}  // namespace scanview
