#include "calib/stereo_rig.h"

#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "tests/expect_error.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

StereoRig some_rig() {
  StereoRig rig;
  rig.left = {Camera::perspective(640, 480, 700, 701, 320.25, 239.5), {-0.1, 0.02, 0.001, -0.002, 0.03, 0, 0, 0}};
  rig.right = {Camera::perspective(640, 480, 705, 706, 318, 241), {-0.2, 0.1, 0, 0, 0, 0.1, 0.2, 0.3}};
  rig.right_from_left.linear() = Eigen::AngleAxisd(0.3, Eigen::Vector3d(0.1, 1, -0.2).normalized()).matrix();
  rig.right_from_left.translation() = Eigen::Vector3d(-100.5, 2, 13);
  rig.standard_deviations = {{"left.fx", 0.25}, {"translation.z", 0.125}};
  return rig;
}

TEST(StereoRig, FileRoundTrip) {
  TemporaryFolder folder;
  StereoRig const rig = some_rig();
  write_stereo_rig(folder.path() / "rig.yml", rig);
  StereoRig const back = read_stereo_rig(folder.path() / "rig.yml");
  EXPECT_EQ(back.left.camera, rig.left.camera);
  EXPECT_EQ(back.right.camera, rig.right.camera);
  EXPECT_EQ(back.left.lens, rig.left.lens);
  EXPECT_EQ(back.right.lens, rig.right.lens);
  EXPECT_TRUE(back.right_from_left.isApprox(rig.right_from_left, 1e-12));
  EXPECT_EQ(back.standard_deviations, rig.standard_deviations);
}

TEST(StereoRig, OpenCvReadsIt) {
  TemporaryFolder folder;
  write_stereo_rig(folder.path() / "rig.yml", some_rig());
  cv::FileStorage const file((folder.path() / "rig.yml").string(), cv::FileStorage::READ);
  cv::Mat m1, d2, r, t;
  file["M1"] >> m1, file["D2"] >> d2, file["R"] >> r, file["T"] >> t;
  EXPECT_EQ(m1.at<double>(0, 2), 320.25);
  EXPECT_EQ(d2.total(), 8u);
  EXPECT_EQ(r.rows, 3);
  EXPECT_EQ(t.at<double>(2), 13);
}

TEST(StereoRig, RaysAndPixelsAreInverse) {
  LensCamera const camera = some_rig().right;
  for (int y = 0; y < 480; y += 37)
    for (int x = 0; x < 640; x += 41) {
      Eigen::Vector2d const pixel(x, y);
      EXPECT_LT((camera.project(7.5 * camera.ray(pixel)) - pixel).norm(), 1e-8);
    }
  EXPECT_TRUE(camera.project({0, 0, -1}).hasNaN());
}

TEST(StereoRig, BadFilesAreNamed) {
  TemporaryFolder folder;
  auto const path = folder.path() / "rig.yml";
  EXPECT_SCANVIEW_ERROR(read_stereo_rig(path), ErrorCode::bad_input, "rig.yml");
  write_file(path, "not yaml at all {{{");
  EXPECT_SCANVIEW_ERROR(read_stereo_rig(path), ErrorCode::bad_input, "OpenCV YAML");
  write_file(path, "%YAML:1.0\n---\nimage_width: 4\nimage_height: 4\n");
  EXPECT_SCANVIEW_ERROR(read_stereo_rig(path), ErrorCode::bad_input, "no 'M1'");
  StereoRig rig = some_rig();
  rig.right_from_left.translation().setZero();
  write_stereo_rig(path, rig);
  EXPECT_SCANVIEW_ERROR(read_stereo_rig(path), ErrorCode::bad_input, "'T' is zero");
  rig = some_rig();
  rig.right_from_left.linear() *= 1.5;
  write_stereo_rig(path, rig);
  EXPECT_SCANVIEW_ERROR(read_stereo_rig(path), ErrorCode::bad_input, "R, T");
}

}  // namespace
}  // namespace scanview
