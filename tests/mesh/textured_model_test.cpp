#include <gtest/gtest.h>

#include <opencv2/core.hpp>
#include <random>

#include "base/error.h"
#include "base/files.h"
#include "mesh/polygon_model.h"
#include "tests/mesh/textured_files.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

using Colors = std::vector<cv::Vec3b>;
using Numbers = std::vector<std::int32_t>;

cv::Vec3b const kPlain{153, 102, 51};

class TexturedModelFile : public ::testing::Test {
 protected:
  TexturedModelFile() {
    file("colors.png", four_colors_png());
    file("square.mtl", "newmtl a\nKd 0.2 0.4 0.6\nmap_Kd colors.png\n");
  }
  void file(std::string const& name, std::string const& bytes) const { write_file(folder_.path() / name, bytes); }
  PolygonModel read(std::string const& name, std::string const& bytes) const {
    file(name, bytes);
    PolygonModel model = read_polygon_model(folder_.path() / name, Winding::keep);
    EXPECT_NO_THROW(model.textures.check(model.mesh.triangles.size()));
    return model;
  }
  /// Two triangles without a texture, and one note that says why.
  void expect_plain(PolygonModel const& model, char const* why) const {
    EXPECT_EQ(model.mesh.triangles.size(), 2u);
    EXPECT_TRUE(model.textures.textures.empty());
    EXPECT_TRUE(model.textures.of_triangle.empty());
    EXPECT_TRUE(model.textures.corners.empty());
    ASSERT_EQ(model.notes.size(), 1u);
    EXPECT_NE(model.notes[0].find(why), std::string::npos) << model.notes[0];
  }

  TemporaryFolder folder_;
};

TEST_F(TexturedModelFile, ModelsWithoutTexturesHaveNone) {
  for (ModelFile const& format : kModelFiles) {
    PolygonModel const model = read(format.name, format.bytes());
    EXPECT_TRUE(model.textures.textures.empty() && model.textures.of_triangle.empty() &&
                model.textures.corners.empty());
    EXPECT_TRUE(model.mesh.colors.empty());
  }
}

TEST_F(TexturedModelFile, CornersLieWhereTheFileSaysWithVDown) {
  TextureCorners const first = {Eigen::Vector2f(0, 1), Eigen::Vector2f(1, 1), Eigen::Vector2f(1, 0)};
  for (PolygonModel const& model : {read("a.obj", square_obj()), read("a.ply", square_ply_by_vertex("s", "t")),
                                    read("a.glb", SquareGltf{}.bytes())}) {
    EXPECT_TRUE(model.notes.empty());
    EXPECT_EQ(model.textures.of_triangle, (Numbers{0, 0}));
    ASSERT_EQ(model.textures.corners.size(), 2u);
    EXPECT_EQ(model.textures.corners[0], first);
    EXPECT_EQ(cv::norm(model.textures.textures.at(0).picture, four_colors(), cv::NORM_INF), 0);
    EXPECT_TRUE(model.mesh.colors.empty()) << "no triangle shows them";
  }
}

TEST_F(TexturedModelFile, APictureThatIsMissingOrDamagedIsANoteAndThePlainColourStandsIn) {
  for (std::string const& bytes : {four_colors_png().substr(0, 50), std::string("no picture"), std::string()}) {
    file("colors.png", bytes);
    PolygonModel const model = read("a.obj", square_obj());
    expect_plain(model, "colors.png");
    EXPECT_EQ(model.mesh.colors, Colors(4, kPlain));
  }
  file("square.mtl",
       "newmtl a\nKd 0.2 0.4 0.6\nmap_Kd ../elsewhere/none.png\nnewmtl b\nKd 0.2 0.4 0.6\nmap_Kd "
       "../elsewhere/none.png\n");
  expect_plain(read("a.obj", square_obj(1, "f 1/1 2/2 3/3\nusemtl b\nf 1/1 3/3 4/4\n")), "none.png");
  file("colors.png", "");
  expect_plain(read("a.ply", square_ply_by_face()), "colors.png");
}

TEST_F(TexturedModelFile, WhatIsWrongWithAGltfTextureIsANote) {
  auto const expect_note = [&](SquareGltf square, char const* why) {
    square.base = R"(,"baseColorFactor":[0.0331048,0.1328683,0.3185468,1])";
    PolygonModel const model = read("a.glb", square.bytes());
    expect_plain(model, why);
    EXPECT_EQ(model.mesh.colors, Colors(4, kPlain)) << why;
  };
  expect_note({.image = R"("uri":"none.png")"}, "none.png");
  expect_note({.image = R"("uri":"data:image/png;base64,AAAA")"}, "image 0");
  expect_note({.image = R"("bufferView":9)"}, "image 0");
  expect_note({.image = R"("bufferView":-1)"}, "image 0");
  expect_note({.image = R"("mimeType":"image/png")"}, "image 0");
  expect_note({.picture = four_colors_png().substr(0, 60)}, "image 0");
  expect_note({.texture_info = R"("index":7)"}, "material 0");
  expect_note({.texture_info = R"("index":"0")"}, "material 0");
  expect_note({.sampler = R"({"wrapS":-5})"}, "material 0");
  expect_note({.texture_info = R"("index":0,"texCoord":4)"}, "2 polygons");
}

TEST_F(TexturedModelFile, GltfCoordinatesThatAreNotThereLeaveTheTrianglesPlain) {
  PolygonModel const model = read("a.glb", SquareGltf{.coordinates = std::string(8, '\0')}.bytes());
  EXPECT_TRUE(model.textures.of_triangle.empty());
  ASSERT_EQ(model.notes.size(), 2u);
  EXPECT_NE(model.notes[0].find("accessor 1 promises more"), std::string::npos) << model.notes[0];
  EXPECT_NE(model.notes[1].find("2 polygons"), std::string::npos) << model.notes[1];
}

TEST_F(TexturedModelFile, FacesWithoutSoundCoordinatesGoWithout) {
  std::string const good = "f 1/1 2/2 3/3\n";
  for (char const* face : {"f 1 3 4\n", "f 1/1 3/3 4/5\n", "f 1/1 3/3 4/-9\n", "f 1/1 3/0 4/4\n", "f 1/1 3/x 4/4\n",
                           "vt nan 0\nf 1/-1 3/3 4/4\n", "vt 0 1e99\nf 1/-1 3/3 4/4\n", "vt\nf 1/-1 3/3 4/4\n"}) {
    PolygonModel const model = read("a.obj", square_obj(1, good + face));
    EXPECT_EQ(model.textures.of_triangle, (Numbers{0, -1})) << face;
    ASSERT_EQ(model.notes.size(), 1u) << face;
    EXPECT_NE(model.notes[0].find("1 polygons have no sound"), std::string::npos);
    EXPECT_EQ(model.mesh.colors, Colors(4, kPlain)) << face;
  }
  EXPECT_TRUE(read("a.obj", "vt nan x\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1/7 2/8 3/-20\n").notes.empty())
      << "of a model without materials nobody asks";
  EXPECT_EQ(read("a.ply", square_ply_by_face("-1")).textures.of_triangle, (Numbers{0, -1}));
  EXPECT_EQ(read("a.ply", square_ply_by_face("1")).textures.of_triangle, (Numbers{0, -1}));
  EXPECT_EQ(read("a.ply", square_ply_by_face("0", "nan 0")).textures.of_triangle, (Numbers{0, -1}));
}

TEST_F(TexturedModelFile, PlainColoursAreTheVerticesWhereTheFileHasNone) {
  file("square.mtl", "newmtl a\nKd 1 0.5 0\nnewmtl b\nKd 0 0 1\nnewmtl c\nKd spectral a.rfl\n");
  cv::Vec3b const a(0, 128, 255), b(255, 0, 0);
  PolygonModel const one = read("a.obj", square_obj());
  EXPECT_EQ(one.mesh.colors, Colors(4, a));
  EXPECT_TRUE(one.textures.of_triangle.empty());
  PolygonModel const apart = read("a.obj", square_obj(1, "f 1 2 3\nv 5 5 5\nv 6 5 5\nv 6 6 5\nusemtl b\nf 5 6 7\n"));
  EXPECT_EQ(apart.mesh.colors, (Colors{a, a, a, {255, 255, 255}, b, b, b}));
  EXPECT_TRUE(apart.textures.of_triangle.empty());
  PolygonModel const shared = read("a.obj", square_obj(1, "f 1 2 3\nusemtl b\nf 1 3 4\nf 1 4 3\n"));
  EXPECT_EQ(shared.mesh.colors, (Colors{a, a, a, b}));
  EXPECT_EQ(shared.textures.of_triangle, (Numbers{-1, 0, 0}));
  ASSERT_EQ(shared.textures.textures.size(), 1u);
  EXPECT_EQ(shared.textures.textures[0].picture(0, 0), b);
  EXPECT_TRUE(read("a.obj", square_obj(1, "usemtl c\nf 1 2 3\n")).mesh.colors.empty()) << "it states no colour";
  std::string own = square_obj();
  for (char const* vertex : {"v 0 0 0", "v 1 0 0", "v 1 1 0", "v 0 1 0"}) own.insert(own.find(vertex) + 7, " 0 1 0");
  EXPECT_EQ(read("a.obj", own).mesh.colors, Colors(4, kGreen));
}

TEST_F(TexturedModelFile, DamageIsRefusedOrReadAndWhatIsReadHoldsTogether) {
  constexpr unsigned kSeed = 7;
  std::mt19937 random(kSeed);
  auto const below = [&random](std::size_t n) { return std::size_t(random()) % n; };
  for (auto const& [name, whole] : {std::pair<std::string, std::string>{"a.obj", square_obj()},
                                    {"a.ply", square_ply_by_face()},
                                    {"a.ply", square_ply_by_vertex("u", "v")},
                                    {"a.glb", SquareGltf{.base = R"(,"baseColorFactor":[0.5,0.25,1,1])"}.bytes()}})
    for (int trial = 0; trial < 2000; ++trial) {
      std::string bytes = whole;
      for (std::size_t k = 1 + below(3); k > 0; --k) bytes[below(bytes.size())] ^= char(1 << below(8));
      if (trial % 4 == 0) bytes.resize(below(bytes.size()));
      SCOPED_TRACE(fmt::format("{}, trial {} of seed {}", name, trial, kSeed));
      try {
        PolygonModel const model = parse_polygon_model(bytes, folder_.path() / name);
        EXPECT_NO_THROW(model.mesh.check());
        EXPECT_NO_THROW(model.textures.check(model.mesh.triangles.size()));
      } catch (Error const& error) {
        EXPECT_EQ(error.code(), ErrorCode::bad_input);
      }
    }
}

}  // namespace
}  // namespace scanview
