#include "register/pose_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "acquire/export.h"
#include "acquire/scan_set_file.h"
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
      marks["marks"][view.name][std::string("p").append(std::to_string(i))] = {pixel.x(), pixel.y()};
    }
    view.image.color = cv::Mat3b(view.image.depth.size(), cv::Vec3b(90, 120, 150));
    set.views.push_back(view);
  }
  return set;
}

class PoseFile : public ::testing::Test {
 protected:
  void SetUp() override { set_ = two_views(second_, marks_); }
  std::filesystem::path write(std::string const& name, std::string const& text) {
    std::filesystem::create_directories((folder_.path() / name).parent_path());
    write_file(folder_.path() / name, text);
    return folder_.path() / name;
  }
  TemporaryFolder folder_;
  Eigen::Isometry3d const second_ = pose(0.1, {0.05, -0.05, 0.1});
  Json marks_;
  ScanSet set_;
};

/// The same set with these poses.
ScanSet posed(ScanSet set, Eigen::Isometry3d const& first, Eigen::Isometry3d const& second) {
  set.views[0].object_from_camera = first;
  set.views[1].object_from_camera = second;
  return set;
}

ScanSet without_poses(ScanSet set) {
  for (View& view : set.views) view.object_from_camera.reset();
  return set;
}

void expect_same_poses(ScanSet const& got, ScanSet const& expected, std::string const& kind) {
  for (std::size_t i = 0; i < expected.views.size(); ++i) {
    ASSERT_TRUE(got.views[i].object_from_camera) << kind;
    EXPECT_TRUE(got.views[i].object_from_camera->isApprox(*expected.views[i].object_from_camera, 1e-9))
        << kind << ", view " << i << ":\n"
        << got.views[i].object_from_camera->matrix();
  }
}

TEST_F(PoseFile, EveryKindThatIsWrittenIsReadBack) {
  ScanSet set = posed(set_, pose(-2.9, {1234.5, -0.001, 3}), pose(1.7, {-0.3, 1e-7, 88}));
  set.unit = Unit::mm;
  set.views[1].name = "a_view-with.a.long.name";
  auto const expect_back = [&](std::string const& kind, std::filesystem::path const& path) {
    ScanSet back = without_poses(set);
    read_poses(path, back);
    expect_same_poses(back, set, kind);
  };
  struct Kind {
    PoseFormat format;
    char const* file;
  };
  for (Kind const& kind : {Kind{PoseFormat::conf, "set.conf"}, Kind{PoseFormat::aln, "set.aln"},
                           Kind{PoseFormat::tum, "tum.txt"}, Kind{PoseFormat::redwood, "redwood.log"}}) {
    write_poses(folder_.path() / kind.file, kind.format, set, folder_.path() / "set");
    expect_back(kind.file, folder_.path() / kind.file);
  }
  Context context;
  export_nerfstudio(folder_.path() / "nerf", set, context);
  expect_back("nerfstudio", folder_.path() / "nerf");
  expect_back("nerfstudio", folder_.path() / "nerf" / "transforms.json");
  export_colmap(folder_.path() / "colmap", set, context);
  expect_back("colmap", folder_.path() / "colmap");
  expect_back("colmap", folder_.path() / "colmap" / "sparse" / "images.txt");
}

// world = R(q)^T p + t: the quaternion of a quarter turn about z that carries x to -y, so that the pose carries x to y.
TEST_F(PoseFile, ConfAndAlnNameTheMeshesOfTheSet) {
  ScanSet const set =
      posed(set_, Eigen::Isometry3d::Identity(),
            Eigen::Translation3d(1, 2, 3) * Eigen::AngleAxisd(std::acos(-1.0) / 2, Eigen::Vector3d::UnitZ()));
  write_poses(folder_.path() / "." / "a.aln", PoseFormat::aln, set, folder_.path() / "my set");
  std::string const aln = read_file(folder_.path() / "a.aln");
  EXPECT_TRUE(
      aln.starts_with("2\nmy set/views/000/mesh.ply\n#\n1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"
                      "my set/views/001/mesh.ply\n#\n"))
      << aln;
  EXPECT_TRUE(aln.ends_with("0 0 0 1\n0\n")) << aln;
  ScanSet back = without_poses(set);
  read_poses(folder_.path() / "a.aln", back);
  expect_same_poses(back, set, "aln");

  EXPECT_SCANVIEW_ERROR(write_poses(folder_.path() / "a.conf", PoseFormat::conf, set, folder_.path() / "my set"),
                        ErrorCode::bad_input, "my set/views/000/mesh.ply");
  write_poses(folder_.path() / "a.conf", PoseFormat::conf, set, folder_.path());
  std::istringstream conf(read_file(folder_.path() / "a.conf"));
  std::string line;
  std::getline(conf, line);
  std::string word, file;
  double n[7];
  conf >> word >> file;
  for (double& number : n) conf >> number;
  EXPECT_EQ(word + " " + file, "bmesh views/001/mesh.ply");
  double const half = std::sqrt(0.5);
  double const expected[] = {1, 2, 3, 0, 0, -half, half};
  for (int i = 0; i < 7; ++i) EXPECT_NEAR(n[i], expected[i], 1e-15) << i;
}

TEST_F(PoseFile, TumLinesAreTakenInOrder) {
  read_poses(write("poses.txt", "# stamp tx ty tz qx qy qz qw\n0.1 1 2 3 0 0 0 1\n0.2 0 0 1 0 1 0 0\n"), set_);
  EXPECT_EQ(set_.views[0].object_from_camera->translation(), Eigen::Vector3d(1, 2, 3));
  // Half a turn about y.
  EXPECT_TRUE(set_.views[1].object_from_camera->linear().isApprox(
      Eigen::Vector3d(-1, 1, -1).asDiagonal().toDenseMatrix(), 1e-14));
}

TEST_F(PoseFile, RedwoodBlocksAreTakenInOrder) {
  read_poses(write("trajectory.log",
                   "0 0 1\n1 0 0 1\n0 1 0 2\n0 0 1 3\n0 0 0 1\n1 1 2\n-1 0 0 0\n0 1 0 0\n0 0 -1 1\n0 0 0 1\n"),
             set_);
  EXPECT_EQ(set_.views[0].object_from_camera->translation(), Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(set_.views[1].object_from_camera->linear(), Eigen::Vector3d(-1, 1, -1).asDiagonal().toDenseMatrix());
}

// A camera of OpenGL that is not turned looks along -z with y up: ours is half a turn about x away from it.
TEST_F(PoseFile, NerfstudioFramesGoByNameWithOpenGlAxes) {
  Json json = {
      {"frames",
       {{{"file_path", "images/001.png"},
         {"transform_matrix", {{1, 0, 0, 5}, {0, 1, 0, 6}, {0, 0, 1, 7}, {0, 0, 0, 1}}}},
        {{"file_path", "./images/000"}, {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}},
        {{"file_path", "images/other.png"},
         {"transform_matrix", {{1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}}}}}}};
  read_poses(write("cameras.json", json.dump()), set_);
  EXPECT_EQ(set_.views[1].object_from_camera->translation(), Eigen::Vector3d(5, 6, 7));
  EXPECT_EQ(set_.views[1].object_from_camera->linear(), Eigen::Vector3d(1, -1, -1).asDiagonal().toDenseMatrix());
  EXPECT_EQ(set_.views[0].object_from_camera->translation(), Eigen::Vector3d(0, 0, 0));
}

// camera_from_world is a shift by (1, 2, 3): the camera stands at its opposite.
TEST_F(PoseFile, ColmapImagesGoByName) {
  read_poses(write("images.txt", "# comment\n7 1 0 0 0 1 2 3 1 001.jpg\n\n3 0 1 0 0 0 0 0 1 000.png\n1 2 -1\n"), set_);
  EXPECT_EQ(set_.views[1].object_from_camera->translation(), Eigen::Vector3d(-1, -2, -3));
  EXPECT_TRUE(set_.views[0].object_from_camera->linear().isApprox(
      Eigen::Vector3d(1, -1, -1).asDiagonal().toDenseMatrix(), 1e-14));
}

TEST_F(PoseFile, LengthsAreConvertedWhereBothUnitsAreKnown) {
  ScanSet metres = posed(set_, pose(0.2, {1, 2, 3}), second_);
  metres.unit = Unit::m;
  Context context;
  export_nerfstudio(folder_.path() / "nerf", metres, context);
  write_manifest(folder_.path(), metres);
  for (char const* file : {"nerf", "scanset.json"}) {
    set_.unit = Unit::mm;
    read_poses(folder_.path() / file, set_);
    EXPECT_TRUE(set_.views[0].object_from_camera->translation().isApprox(Eigen::Vector3d(1000, 2000, 3000), 1e-12));
    set_.unit = Unit::arbitrary;
    read_poses(folder_.path() / file, set_);
    EXPECT_TRUE(set_.views[0].object_from_camera->translation().isApprox(Eigen::Vector3d(1, 2, 3), 1e-12));
  }
  // A trajectory names no unit: its lengths are the set's.
  set_.unit = Unit::mm;
  read_poses(write("tum.txt", "0 5 0 0 0 0 0 1\n1 0 0 0 0 0 0 1\n"), set_);
  EXPECT_EQ(set_.views[0].object_from_camera->translation(), Eigen::Vector3d(5, 0, 0));
}

TEST_F(PoseFile, AViewWithoutAPoseIsNotWritten) {
  ScanSet set = posed(set_, second_, second_);
  set.views[1].object_from_camera.reset();
  for (PoseFormat const format : {PoseFormat::conf, PoseFormat::aln, PoseFormat::tum, PoseFormat::redwood})
    EXPECT_SCANVIEW_ERROR(write_poses(folder_.path() / "out", format, set, folder_.path()), ErrorCode::bad_input,
                          "view 001: it has no pose");
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out"));
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
  std::string const rows = "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", line = "0 0 0 0 0 0 0 1\n";
  refused("few.txt", line, "has 1 poses for 2 views: none of view 001");
  refused("many.txt", line + line + line, "has 3 poses for 2 views");
  refused("bad.txt", "0 0 0 0 0 0 0 2\n" + line, "view 000: the pose of line 1 is no rotation");
  refused("nan.txt", line + "1 nan 0 0 0 0 0 1\n", "view 001: the pose of line 2 has a number that is not finite");
  refused("cut.txt", line + "1 0 0 0", "line 2 is not 'time tx");
  refused("word.txt", line + "1 0 x 0 0 0 0 1", "line 2: 'x' is no number");
  refused("empty.txt", "", "has 0 poses for 2 views: none of view 000");
  refused("few.log", "0 0 1\n" + rows, "has 1 poses for 2 views: none of view 001");
  refused("many.log", "0 0 1\n" + rows + "1 1 2\n" + rows + "2 2 3\n" + rows, "has 3 poses for 2 views");
  refused("cut.log", "0 0 1\n" + rows + "1 1 2\n1 0 0 0\n", "ends within the pose of line 6");
  refused("shift.log", "0 0 1\n" + rows + rows, "line 6 is not three integers");
  refused("row.log", "0 0 1\n1 0 0\n" + rows, "line 2 is not 4 numbers");
  refused("mirror.log", "0 0 1\n" + rows + "1 1 2\n-1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
          "view 001: the pose of line 6 is no rotation");
  refused("nan.log", "0 0 1\n" + rows + "1 1 2\n1 0 0 nan\n0 1 0 0\n0 0 1 0\n0 0 0 1\n",
          "view 001: the pose of line 6 has a number that is not finite");
  std::string const first = "bmesh views/000/mesh.ply 0 0 0 0 0 0 1\n";
  refused("few.conf", first, "has no pose of view 001");
  refused("cut.conf", first + "bmesh views/001/mesh.ply 0 0 0 0", "the line of views/001/mesh.ply has 4 numbers");
  refused("bad.conf", first + "bmesh views/001/mesh.ply 0 0 0 0 0 0 3",
          "the pose of views/001/mesh.ply is no rotation");
  refused("nan.conf", first + "bmesh views/001/mesh.ply nan 0 0 0 0 0 1",
          "views/001/mesh.ply has a number that is not");
  refused("twice.conf", first + first, "has two poses of view 000");
  refused("none.conf", "camera 0 0 0 0 0 0 1\n", "no 'bmesh FILE");
  refused("cut/images.txt", "1 1 0 0 0 0 0 0 1\n", "line 1 is not 'id qw");
  refused("few/images.txt", "1 1 0 0 0 0 0 0 1 000.png\n\n", "has no pose of view 001");
  refused("bad/images.txt", "1 1 0 0 0 0 0 0 1 000.png\n\n2 1 1 0 0 0 0 0 1 001.png\n\n",
          "the pose of 001.png is no rotation");
  refused("nan/images.txt", "1 nan 0 0 0 0 0 0 1 000.png\n", "the pose of 000.png has a number that is not finite");
  refused("cut.aln.json", "{\"frames\": [", "json");
  Json nerf = {{"frames", {{{"file_path", "000.png"}, {"transform_matrix", Json::array({1, 2})}}}}};
  refused("rows.json", nerf.dump(), "'transform_matrix' of frame 000 is not 4 rows");
  nerf["frames"][0]["transform_matrix"] = {{1, 0, 0, 0}, {0, 3, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  refused("turn.json", nerf.dump(), "'transform_matrix' of frame 000 is no rotation");
  nerf["frames"][0]["transform_matrix"][1][1] = 1;
  refused("few.json", nerf.dump(), "has no pose of view 001");
  nerf["frames"][0].erase("transform_matrix");
  refused("none.json", nerf.dump(), "'transform_matrix' of frame 000 is missing");
  EXPECT_SCANVIEW_ERROR(read_poses(folder_.path(), set_), ErrorCode::bad_input, "is a folder without scanset.json");
  EXPECT_SCANVIEW_ERROR(read_poses(folder_.path() / "nowhere.txt", set_), ErrorCode::bad_input, "nowhere.txt");
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
