#include "mesh/mesh_marks.h"

#include <gtest/gtest.h>

#include "mesh/textured_mesh.h"
#include "tests/expect_error.h"
#include "tests/mesh/depth_maps.h"
#include "tests/mesh/reference_raster.h"

namespace scanview {
namespace {

using namespace testing;

RangeImage wall() {
  return depth_map(small_camera(), 1e-3, [](int x, int y) { return 2 + 0.001 * x + 0.002 * y; });
}

ViewMeshResult mesh(RangeImage const& image, MeshMarks const& marks) {
  Context context;
  return mesh_range_image(image, {}, context, marks);
}

TEST(MeshMarks, AreReadAndCheckedByName) {
  auto const marks = mesh_marks_from_json(
      Json::parse(R"({"000": {"keep": [[[0, 0], [10, 0], [10, 9.5]]], "cut": [[[1, 2], [3, 4]]]}})"), "marks.json");
  ASSERT_EQ(marks.at("000").keep.size(), 1u);
  EXPECT_EQ(marks.at("000").keep[0][2], Eigen::Vector2d(10, 9.5));
  EXPECT_EQ(marks.at("000").cut[0].size(), 2u);
  for (auto const& [text, named] : {std::pair(R"({"000": {"keeps": []}})", "keeps"),
                                    std::pair(R"({"000": {"keep": [[[0, 0], [1, 1]]]}})", "000.keep"),
                                    std::pair(R"({"000": {"cut": [[[0, 0]]]}})", "000.cut"),
                                    std::pair(R"({"000": {"remove": [[[0, 0], [1, 1], [2]]]}})", "000.remove"),
                                    std::pair(R"({"000": {"remove": [[[0, 0], [1, 1], [2, "x"]]]}})", "000.remove"),
                                    std::pair(R"({"000": {"remove": 5}})", "000.remove")}) {
    SCOPED_TRACE(text);
    try {
      mesh_marks_from_json(Json::parse(text), "marks.json");
      FAIL();
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input);
      EXPECT_NE(std::string(error.what()).find(named), std::string::npos) << error.what();
    }
  }
}

TEST(MeshMarks, KeepAndRemoveDecideByPixelCentres) {
  RangeImage const image = wall();
  MeshMarks marks;
  marks.keep = {{{9.5, 9.5}, {49.5, 9.5}, {49.5, 39.5}, {9.5, 39.5}}};
  marks.remove = {{{19.5, 19.5}, {29.5, 19.5}, {29.5, 29.5}, {19.5, 29.5}}};
  ViewMeshResult const result = mesh(image, marks);
  ReferenceRaster const raster = reference_raster(image, result.view_mesh.mesh);
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 96; ++x) {
      bool const kept = x >= 10 && x < 50 && y >= 10 && y < 40;
      bool const removed = x >= 20 && x < 30 && y >= 20 && y < 30;
      EXPECT_EQ(raster.count(y, x) > 0, kept && !removed) << x << ", " << y;
    }
  EXPECT_EQ(result.figures.uncovered, 0) << "what was taken away by hand is not missed";
  EXPECT_TRUE(image.has_depth(0, 0)) << "the view itself stays as it is";
}

TEST(MeshMarks, ACutPartsTheMesh) {
  RangeImage const image = wall();
  MeshMarks marks;
  marks.cut = {{{47.3, -2}, {45.1, 40}, {60.7, 82}}};
  ViewMeshResult const result = mesh(image, marks);
  EXPECT_EQ(result.figures.uncovered, 0);
  // A plane in two pieces; no vertex belongs to both.
  std::vector<int> part(result.view_mesh.mesh.vertices.size());
  for (std::size_t i = 0; i < part.size(); ++i) part[i] = int(i);
  auto const root = [&](int i) {
    while (part[i] != i) i = part[i];
    return i;
  };
  for (Eigen::Vector3i const& t : result.view_mesh.mesh.triangles)
    for (int i = 1; i < 3; ++i) part[root(t[i])] = root(t[0]);
  int parts = 0;
  for (std::size_t i = 0; i < part.size(); ++i) parts += root(int(i)) == int(i);
  EXPECT_EQ(parts, 2);
  // In row 20 the cut passes at 46.1, between columns 46 and 47: half a pixel away, of 16 to the full weight.
  EXPECT_EQ(result.view_mesh.feather(20, 46), 8);
  EXPECT_EQ(result.view_mesh.feather(20, 47), 8);
}

TEST(TexturedMesh, TheCropIsPaddedWithTheObjectsColours) {
  Camera const camera = small_camera();
  View view;
  view.name = "a";
  view.image = depth_map(camera, 1e-3, [](int x, int y) {
    return x >= 30 && x < 60 && y >= 20 && y < 50 ? 2.0 : std::numeric_limits<double>::quiet_NaN();
  });
  view.image.color.setTo(cv::Vec3b(255, 0, 255));
  view.image.color(cv::Rect(30, 20, 30, 30)).setTo(cv::Vec3b(10, 120, 30));
  Context context;
  ViewMesh const view_mesh = mesh_range_image(view.image, {}, context).view_mesh;
  EXPECT_EQ(covered_rectangle(view_mesh, 3), cv::Rect(27, 17, 36, 36));
  EXPECT_EQ(covered_rectangle(view_mesh, 100), cv::Rect(0, 0, 96, 80));
  TexturedMesh const textured = textured_mesh(view_mesh, view);
  ASSERT_EQ(textured.picture.size(), cv::Size(46, 46));
  for (cv::Vec3b const& color : textured.picture) EXPECT_EQ(color, cv::Vec3b(10, 120, 30));
  for (std::size_t v = 0; v < textured.plain.size(); ++v) {
    Eigen::Vector2d const pixel = camera.project(textured.mesh.vertices[v].cast<double>());
    EXPECT_NEAR(textured.plain[v].x(), (pixel.x() + 0.5 - 22) / 46, 1e-5);
    EXPECT_NEAR(textured.plain[v].y(), (pixel.y() + 0.5 - 12) / 46, 1e-5);
  }
  ObjFiles const files = encode_obj(view_mesh, view);
  EXPECT_NE(files.obj.find("usemtl a\n"), std::string::npos);
  EXPECT_NE(files.mtl.find("map_Kd a.jpg"), std::string::npos);
  EXPECT_FALSE(files.jpeg.empty());
}

}  // namespace
}  // namespace scanview
