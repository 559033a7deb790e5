#include "mesh/triangle_mesh.h"

#include <archive.h>
#include <archive_entry.h>
#include <gtest/gtest.h>

#include "base/error.h"
#include "base/files.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

class TriangleMeshFile : public ::testing::Test {
 protected:
  TriangleMeshFile() {
    folder_ = fs::path(::testing::TempDir()) /
              (std::string("scanview_") + ::testing::UnitTest::GetInstance()->current_test_info()->name());
    fs::create_directories(folder_);
  }
  ~TriangleMeshFile() override { fs::remove_all(folder_); }

  fs::path file(std::string const& name, std::string const& bytes) const {
    write_file(folder_ / name, bytes);
    return folder_ / name;
  }
  void expect_refused(std::string const& name, std::string const& bytes, std::string const& why) const {
    try {
      read_triangle_mesh(file(name, bytes));
      ADD_FAILURE() << "accepted: " << bytes;
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(error.what()).find(why), std::string::npos) << error.what();
      EXPECT_NE(std::string(error.what()).find(name), std::string::npos) << error.what();
    }
  }

  fs::path folder_;
};

std::string ply(std::string const& rest) {
  return "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n" + rest;
}
std::string const kFive = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n";

using Triangles = std::vector<Eigen::Vector3i>;

TEST_F(TriangleMeshFile, PolygonsAreFanned) {
  TriangleMesh const mesh =
      read_triangle_mesh(file("a.ply", ply("element face 2\nproperty list uchar int vertex_index\nend_header\n" +
                                           kFive + "4 0 1 2 3\n3 0 1 4\n")));
  EXPECT_EQ(mesh.vertices.size(), 5u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 2, 3}, {0, 1, 4}}));
}

TEST_F(TriangleMeshFile, StripsAreUnrolledAndRestarted) {
  // 0 1 2 3: (0 1 2), (2 1 3). After −1 the turn starts anew. Doubled vertices make no triangles.
  TriangleMesh const mesh =
      read_triangle_mesh(file("a.ply", ply("element tristrips 1\nproperty list int int vertex_indices\nend_header\n" +
                                           kFive + "13 0 1 2 3 -1 2 3 4 -1 0 1 1 4\n")));
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {2, 1, 3}, {2, 3, 4}}));
}

TEST_F(TriangleMeshFile, WhatIsWrittenIsRead) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0.1f, -2}, {1e-20f, 3e20f, 1}, {4, 5, 6}, {-0.0f, 7, 8}};
  mesh.triangles = {{0, 1, 2}, {3, 2, 1}};
  for (int i = 0; i < 4; ++i) mesh.colors.push_back(cv::Vec3b(uchar(i), uchar(255 - i), uchar(7 * i)));
  write_triangle_mesh(folder_ / "m.ply", mesh);
  TriangleMesh const read = read_triangle_mesh(folder_ / "m.ply");
  EXPECT_EQ(read.vertices, mesh.vertices);
  EXPECT_EQ(read.triangles, mesh.triangles);
  EXPECT_EQ(read.colors, mesh.colors);
}

TEST_F(TriangleMeshFile, ObjFormsOfFaces) {
  std::string const obj =
      "# a comment\nmtllib x.mtl\nv 0 0 0\nv 1 0 0 1.0\r\nv +1 1e0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\ng name\n"
      "f 1 2 3\nf 1/1 2/1 3/1 4/1\nf 1//1 3//1 4//1\nf 1/1/1 2/1/1 \\\n4/1/1\nf -4 -3 -1\n";
  TriangleMesh const mesh = read_triangle_mesh(file("a.obj", obj));
  EXPECT_EQ(mesh.vertices.size(), 4u);
  EXPECT_EQ(mesh.triangles, (Triangles{{0, 1, 2}, {0, 1, 2}, {0, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 3}}));
  EXPECT_TRUE(mesh.colors.empty());
}

TEST_F(TriangleMeshFile, ObjColoursOfVertices) {
  TriangleMesh const mesh =
      read_triangle_mesh(file("a.obj", "v 0 0 0 1 0 0.5\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n"));
  EXPECT_EQ(mesh.colors, (std::vector<cv::Vec3b>{{128, 0, 255}, {0, 255, 0}, {255, 0, 0}}));
}

TEST_F(TriangleMeshFile, BadInputIsRefusedByName) {
  std::string const face = "element face 1\nproperty list uchar int vertex_indices\nend_header\n";
  expect_refused("a.ply", ply(face + kFive + "3 0 1 5\n"), "vertex 5");
  expect_refused("a.ply", ply(face + kFive + "3 0 1 -1\n"), "vertex -1");
  expect_refused("a.ply", ply(face + kFive + "2 0 1\n"), "2 vertices");
  expect_refused("a.ply", ply(face + "0 0 nan\n1 0 0\n1 1 0\n0 1 0\n0 0 1\n3 0 1 2\n"), "");
  expect_refused("a.ply",
                 ply("element tristrips 1\nproperty list int int vertex_indices\nend_header\n" + kFive + "4 0 1 2 9\n"),
                 "vertex 9");
  expect_refused("a.ply", ply(face + kFive), "");
  expect_refused("a.ply", "ply\nformat ascii 1.0\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n",
                 "vertex");
  expect_refused("a.ply",
                 "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\nproperty float x\n"
                 "property float y\nproperty float z\nend_header\n",
                 "");
  expect_refused("a.obj", "v 0 0\n", "line 1");
  expect_refused("a.obj", "v 0 0 x\n", "line 1");
  expect_refused("a.obj", "v 0 0 inf\n", "finite");
  expect_refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "vertex 3");
  expect_refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 2 3\n", "vertex -1");
  expect_refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 2 3\n", "line 4");
  expect_refused("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\n", "2 vertices");
  expect_refused("a.obj", "P 0.3 0.3 0.4 10 1 81924\n 1 2 3\n", "81924 points");
  expect_refused("a.obj", "nothing", "no vertices");
  expect_refused("a.txt", "solid", "not a model");
  expect_refused("a.obj.gz", "v 0 0 0\n", "gzip");
}

TEST_F(TriangleMeshFile, EveryTruncatedLengthIsRefusedOrRead) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 2}};
  write_triangle_mesh(folder_ / "m.ply", mesh);
  std::string const whole = read_file(folder_ / "m.ply");
  for (std::size_t n = 0; n < whole.size(); ++n) {
    EXPECT_THROW(read_triangle_mesh(file("t.ply", whole.substr(0, n))), Error) << n;
  }
}

TEST(TriangleMesh, CheckRefusesWhatDoesNotHold) {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles = {{0, 1, 3}};
  EXPECT_THROW(mesh.check(), std::logic_error);
  mesh.triangles = {{0, 1, 2}};
  EXPECT_NO_THROW(mesh.check());
  mesh.colors.push_back(cv::Vec3b(1, 2, 3));
  EXPECT_THROW(mesh.check(), std::logic_error);
  mesh.colors.clear();
  mesh.vertices[1].x() = NAN;
  EXPECT_THROW(mesh.check(), std::logic_error);
}

struct Model {
  char const* name;
  std::size_t triangles;
};

class RealModels : public ::testing::TestWithParam<Model> {};

TEST_P(RealModels, AreRead) {
  fs::path const path = fs::path(SCANVIEW_SOURCE_DIR) / "../shared/data/models" / GetParam().name;
  if (!fs::exists(path)) GTEST_SKIP() << "no data: models/" << GetParam().name;
  TriangleMesh const mesh = read_triangle_mesh(path);
  EXPECT_NO_THROW(mesh.check());
  if (GetParam().triangles > 0) {
    EXPECT_EQ(mesh.triangles.size(), GetParam().triangles);
  }
}

// igea's strips hold 268 686 triangles, Euler's number of a closed surface of its 134 345 vertices.
INSTANTIATE_TEST_SUITE_P(Models, RealModels,
                         ::testing::Values(Model{"horse.ply", 96966}, Model{"armadillo.obj", 86482},
                                           Model{"igea.ply", 268686}, Model{"car.obj.gz", 56042}));

TEST(RealModels, TheBunnyInsideItsArchiveIsRead) {
  fs::path const path = fs::path(SCANVIEW_SOURCE_DIR) / "../shared/data/bunny_range.tar.xz";
  if (!fs::exists(path)) GTEST_SKIP() << "no data: bunny_range.tar.xz";
  struct archive* const reader = archive_read_new();
  archive_read_support_filter_all(reader);
  archive_read_support_format_tar(reader);
  ASSERT_EQ(archive_read_open_filename(reader, path.c_str(), 1 << 16), ARCHIVE_OK);
  struct archive_entry* entry = nullptr;
  bool found = false;
  while (!found && archive_read_next_header(reader, &entry) == ARCHIVE_OK) {
    if (!std::string(archive_entry_pathname(entry)).ends_with("bun_zipper.ply")) continue;
    std::string bytes(std::size_t(archive_entry_size(entry)), '\0');
    ASSERT_EQ(archive_read_data(reader, bytes.data(), bytes.size()), la_ssize_t(bytes.size()));
    fs::path const file = fs::path(::testing::TempDir()) / "scanview_bun_zipper.ply";
    write_file(file, bytes);
    EXPECT_EQ(read_triangle_mesh(file).triangles.size(), 69451u);
    fs::remove(file);
    found = true;
  }
  archive_read_free(reader);
  EXPECT_TRUE(found);
}

}  // namespace
}  // namespace scanview
