#include "mesh/polygon_model.h"

#include <gtest/gtest.h>
#include <libdeflate.h>

#include <Eigen/Geometry>

#include "base/files.h"
#include "tests/expect_error.h"
#include "tests/mesh/model_files.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Triangles = std::vector<Eigen::Vector3i>;
using Flags = std::vector<std::uint8_t>;

double volume(TriangleMesh const& mesh) {
  double sum = 0;
  for (Eigen::Vector3i const& t : mesh.triangles)
    sum += mesh.vertices[t[0]].cast<double>().dot(
        mesh.vertices[t[1]].cast<double>().cross(mesh.vertices[t[2]].cast<double>()));
  return sum / 6;
}

std::string gzipped(std::string const& bytes) {
  libdeflate_compressor* const compressor = libdeflate_alloc_compressor(6);
  std::string packed(libdeflate_gzip_compress_bound(compressor, bytes.size()), '\0');
  packed.resize(libdeflate_gzip_compress(compressor, bytes.data(), bytes.size(), packed.data(), packed.size()));
  libdeflate_free_compressor(compressor);
  return packed;
}

std::string joined_notes(PolygonModel const& model) {
  std::string text;
  for (std::string const& note : model.notes) text += note + "\n";
  return text;
}

class PolygonModelFile : public ::testing::Test {
 protected:
  fs::path file(std::string const& name, std::string const& bytes) const {
    write_file(folder_.path() / name, bytes);
    return folder_.path() / name;
  }
  PolygonModel read(std::string const& name, std::string const& bytes, Winding winding = Winding::keep) const {
    return read_polygon_model(file(name, bytes), winding);
  }

  TemporaryFolder folder_;
};

TEST_F(PolygonModelFile, ACubeIsTheSameInEveryFormat) {
  for (ModelFile const& format : kModelFiles)
    for (bool const packed : {false, true}) {
      SCOPED_TRACE(format.name + std::string(packed ? ".gz" : ""));
      std::string const bytes = format.bytes();
      PolygonModel const model = packed ? read(format.name + std::string(".gz"), gzipped(bytes), Winding::automatic)
                                        : read(format.name, bytes, Winding::automatic);
      EXPECT_NO_THROW(model.mesh.check());
      EXPECT_EQ(model.mesh.vertices.size(), 8u);
      EXPECT_EQ(model.mesh.triangles.size(), 12u);
      EXPECT_EQ(model.polygon_count(), format.polygons);
      EXPECT_EQ(volume(model.mesh), 8);
      EXPECT_TRUE(model.transparent.empty());
      EXPECT_EQ(joined_notes(model).find("turned"), std::string::npos);
      EXPECT_EQ(read_triangle_mesh(folder_.path() / format.name).triangles, model.mesh.triangles);
    }
}

TEST_F(PolygonModelFile, ContentGoesBeforeTheEnding) {
  for (ModelFile const& format : kModelFiles) {
    if (std::string(format.name) == "cube.obj" || std::string(format.name) == "cube.stl")
      continue;  // told by nothing else
    EXPECT_EQ(read("model", format.bytes()).mesh.triangles.size(), 12u) << format.name;
    EXPECT_EQ(read("model.dat.gz", gzipped(format.bytes())).mesh.triangles.size(), 12u) << format.name;
  }
  EXPECT_SCANVIEW_ERROR(read("model", cube_obj()), ErrorCode::bad_input, "not a model we read");
  EXPECT_SCANVIEW_ERROR(read("model.ply", "ply"), ErrorCode::bad_input, "PLY");
  EXPECT_SCANVIEW_ERROR(read("empty.ply", cube_ply().replace(cube_ply().find("face 6"), 6, "face 0")),
                        ErrorCode::bad_input, "no polygons");
}

TEST_F(PolygonModelFile, PolygonsKeepTheirTriangles) {
  PolygonModel const model =
      read("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 5\nf 1 2 3 4\nf 1 3 5\n");
  EXPECT_EQ(model.mesh.triangles, (Triangles{{0, 1, 4}, {0, 1, 2}, {0, 2, 3}, {0, 2, 4}}));
  EXPECT_EQ(model.polygons, (std::vector<std::int32_t>{0, 1, 1, 2}));
  EXPECT_EQ(model.polygon_count(), 3u);
  PolygonModel const triangles = read("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\nf 3 2 1\n");
  EXPECT_TRUE(triangles.polygons.empty());
  EXPECT_EQ(triangles.polygon_count(), 2u);
}

TEST_F(PolygonModelFile, InsideOutIsTurnedUnlessToldOtherwise) {
  std::string const loose_triangle = "v 9 9 9\nv 9 9 8\nv 9 8 9\nf 9 10 11\n";
  std::string const inside_out = cube_rows("v {} {} {}\n", "f {3} {2} {1} {0}\n", 1) + loose_triangle;
  PolygonModel const turned = read("a.obj", inside_out, Winding::automatic);
  EXPECT_NE(joined_notes(turned).find("wound inwards"), std::string::npos);
  PolygonModel const kept = read("a.obj", inside_out, Winding::keep);
  EXPECT_TRUE(kept.notes.empty());
  PolygonModel const flipped = read("a.obj", inside_out, Winding::flip);
  EXPECT_EQ(flipped.mesh.triangles, turned.mesh.triangles);
  EXPECT_EQ(flipped.polygons, kept.polygons);
  for (std::size_t i = 0; i < kept.mesh.triangles.size(); ++i) {
    Eigen::Vector3i const &a = kept.mesh.triangles[i], &b = turned.mesh.triangles[i];
    EXPECT_EQ(b, Eigen::Vector3i(a[0], a[2], a[1]));
  }
}

TEST_F(PolygonModelFile, PlyAlphaOfFacesAndVertices) {
  std::string const head =
      "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n";
  std::string const list = "property list uchar int vertex_indices\n";
  EXPECT_EQ(read("a.ply", head + "element face 2\n" + list + "property uchar alpha\nend_header\n" +
                              "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 254\n3 0 1 2 255\n")
                .transparent,
            (Flags{1, 1, 0}));
  EXPECT_EQ(read("a.ply", head + "property float alpha\nelement face 2\n" + list + "end_header\n" +
                              "0 0 0 1\n1 0 0 1\n1 1 0 1\n0 1 0 .5\n3 0 1 2\n3 0 2 3\n")
                .transparent,
            (Flags{0, 1}));
  PolygonModel const unset = read("a.ply", head + "property uchar alpha\nelement face 1\n" + list + "end_header\n" +
                                               "0 0 0 0\n1 0 0 0\n1 1 0 0\n0 1 0 0\n3 0 1 2\n");
  EXPECT_TRUE(unset.transparent.empty());
  EXPECT_NE(joined_notes(unset).find("alpha 0"), std::string::npos);
}

TEST_F(PolygonModelFile, ObjMaterials) {
  file("glass and more.mtl",
       "# d goes before Tr\nnewmtl solid\nd 1.0\nTr 1\nnewmtl a glass#1\r\nKd 1 1 1\r\nd 0.5\r\nnewmtl tr\nTr 0.25\n"
       "newmtl leaf\nmap_d leaf.png\nnewmtl halo\nd -halo 0.3\nnewmtl plain\nTr 0\n");
  std::string obj = "mtllib glass and more.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n";
  for (char const* name : {"solid", "a glass#1", "tr", "leaf", "halo", "plain", "unknown"})
    obj += std::string("usemtl ") + name + "\nf 1 2 3 # a comment\n";
  PolygonModel const model = read("a.obj", obj);
  EXPECT_EQ(model.transparent, (Flags{0, 0, 1, 1, 1, 1, 0, 0}));
  EXPECT_TRUE(model.notes.empty());

  file("b.mtl", "newmtl b\nd 0\n");
  std::string const face = "v 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl b\nf 1 2 3\n";
  for (char const* name : {"b.mtl", "./b.mtl", "C:\\models\\b.mtl", "/elsewhere/b.mtl", "../b.mtl", "b.mtl c.mtl"}) {
    if (std::string(name).ends_with("c.mtl")) file("c.mtl", "newmtl c\n");
    EXPECT_EQ(read("a.obj", "mtllib " + std::string(name) + "\n" + face).transparent, Flags{1}) << name;
  }
  PolygonModel const missing = read("a.obj", "mtllib none.mtl\nmtllib none.mtl\n" + face);
  EXPECT_TRUE(missing.transparent.empty());
  EXPECT_EQ(missing.notes.size(), 1u);
  EXPECT_NE(joined_notes(missing).find("none.mtl"), std::string::npos);
}

TEST_F(PolygonModelFile, OffKeywordsColoursAndComments) {
  PolygonModel const colors =
      read("a.off",
           "COFF # with colours\n4 3 0\n0 0 0 255 0 0 255\n1 0 0 0 255 0 255 # here\n# and here\n1 1 0 0 0 255 255\n"
           "0 1 0 9 9 9 100\n3 0 1 2\n3 0 2 3\n2 0 1\n");
  EXPECT_EQ(colors.mesh.colors, (std::vector<cv::Vec3b>{{0, 0, 255}, {0, 255, 0}, {255, 0, 0}, {9, 9, 9}}));
  EXPECT_EQ(colors.transparent, (Flags{0, 1}));
  EXPECT_NE(joined_notes(colors).find("1 faces of fewer than three"), std::string::npos);

  std::string const four = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";
  PolygonModel const faces = read("a.off", "OFF 4 5 0\n" + four +
                                               "3 0 1 2 1 0 0 1\n3 0 1 2 0.5 0.5 0.5 0.5\n3 0 1 2 10 20 30 40\n"
                                               "3 0 1 2 7\n4 0 1 2 3 255 255 255 255\n");
  EXPECT_EQ(faces.transparent, (Flags{0, 1, 1, 0, 0, 0}));
  EXPECT_EQ(read("a.off", "4 1 0\n" + four + "3 0 1 2").mesh.triangles.size(), 1u);
  EXPECT_EQ(read("a.off", "NOFF\n3 1 0\n0 0 0 0 0 1\n1 0 0\n0 0 1\n1 1 0 0 0 1\n3 0 1 2\n").mesh.vertices[2],
            Eigen::Vector3f(1, 1, 0));
  EXPECT_EQ(read("a.off", "ST4nOFF 3\n3 1 0\n0 0 0 1 .5 .5\n2 0 0 2 0 0\n3 3 0 3 0 0\n3 0 1 2\n").mesh.vertices[2],
            Eigen::Vector3f(1, 1, 0));
  EXPECT_SCANVIEW_ERROR(read("a.off", "nOFF 4\n1 0 0\n0 0 0 0\n"), ErrorCode::bad_input, "4 dimensions");
  EXPECT_SCANVIEW_ERROR(read("a.off", "OFF\n2000000000 1 0\n0 0 0\n"), ErrorCode::bad_input, "more than there are");
}

TEST_F(PolygonModelFile, StlCornersAreJoinedAndTheDamagedNamed) {
  EXPECT_NE(joined_notes(read("a.stl", cube_stl())).find("36 vertices were joined to 8"), std::string::npos);
  EXPECT_EQ(read("a.stl", cube_stl() + cube_stl()).mesh.triangles.size(), 24u);
  EXPECT_EQ(read("a.stl", cube_stl_binary() + "xy").mesh.triangles.size(), 12u);
  EXPECT_SCANVIEW_ERROR(read("a.stl", cube_stl_binary().substr(0, 600)), ErrorCode::bad_input, "12 facets");
  EXPECT_SCANVIEW_ERROR(read("a.stl", cube_stl().substr(0, 900)), ErrorCode::bad_input, "");
  EXPECT_SCANVIEW_ERROR(read("a.stl", "solid a\nfacet normal 0 0 0\nvertex 0 0 nan\n"), ErrorCode::bad_input, "finite");
}

TEST_F(PolygonModelFile, MniOpacityAndColours) {
  std::string text = cube_mni();
  text.replace(text.find("10 1 8"), 6, "10 .5 8");
  EXPECT_EQ(read("a.obj", text).transparent, Flags(12, 1));
  text = cube_mni();
  std::string colors = " 1 ";
  for (int i = 0; i < 6; ++i) colors += i == 2 ? "1 1 1 0.5\n" : "1 1 1 1\n";
  text.replace(text.find(" 0 1 1 1 1\n"), 11, colors);
  EXPECT_EQ(read("a.obj", text).transparent, (Flags{0, 0, 0, 0, 1, 1, 0, 0, 0, 0, 0, 0}));
  text = cube_mni();
  colors = " 2 ";
  for (int i = 0; i < 8; ++i) colors += "1 0.5 0 1\n";
  text.replace(text.find(" 0 1 1 1 1\n"), 11, colors);
  EXPECT_EQ(read("a.obj", text).mesh.colors, std::vector<cv::Vec3b>(8, cv::Vec3b(0, 128, 255)));
}

TEST_F(PolygonModelFile, FreeSurferQuadranglesAreRefusedByName) {
  EXPECT_SCANVIEW_ERROR(read("lh.orig", "\xff\xff\xff" + std::string(100, '\0')), ErrorCode::bad_input, "quadrangles");
  EXPECT_EQ(read("lh.white", cube_freesurfer() + "tags").mesh.triangles.size(), 12u);
}

}  // namespace
}  // namespace scanview
