#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include "base/files.h"
#include "mesh/polygon_model.h"
#include "tests/expect_error.h"
#include "tests/mesh/model_files.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

using Triangles = std::vector<Eigen::Vector3i>;
using Flags = std::vector<std::uint8_t>;

PolygonModel parse(std::string const& bytes) { return parse_polygon_model(bytes, "test.glb"); }

/// A file of one square of vertices (0, 0), (1, 0), (1, 1), (0, 1), whose primitives are given, with indices that are.
std::string square(std::string const& primitives, std::string const& indices, int component_type, int count,
                   std::string const& more = "", std::string const& nodes = R"({"mesh":0})") {
  std::string const positions = packed<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
  return glb(fmt::format(R"({{"asset":{{"version":"2.0"}},"nodes":[{}],"meshes":[{{"primitives":[{}]}}],)"
                         R"("accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},)"
                         R"({{"bufferView":1,"componentType":{},"count":{},"type":"SCALAR"}}],"bufferViews":[)"
                         R"({{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":{}}}],)"
                         R"("buffers":[{{"byteLength":{}}}]{}}})",
                         nodes, primitives, component_type, count, indices.size(), 48 + indices.size(), more),
             positions + indices);
}
std::string primitive(int mode, std::string const& more = "") {
  return fmt::format(R"({{"attributes":{{"POSITION":0}},"indices":1,"mode":{}{}}})", mode, more);
}

TEST(GltfModel, TrianglesStripsAndFansOfEveryIndexType) {
  Triangles const expected = {{0, 1, 2}, {0, 2, 3}};
  EXPECT_EQ(parse(square(primitive(4), packed<char>({0, 1, 2, 0, 2, 3}), 5121, 6)).mesh.triangles, expected);
  EXPECT_EQ(parse(square(primitive(4), packed<short>({0, 1, 2, 0, 2, 3}), 5123, 6)).mesh.triangles, expected);
  EXPECT_EQ(parse(square(primitive(4), packed<int>({0, 1, 2, 0, 2, 3}), 5125, 6)).mesh.triangles, expected);
  EXPECT_EQ(parse(square(primitive(6), packed<char>({0, 1, 2, 3}), 5121, 4)).mesh.triangles, expected);
  EXPECT_EQ(parse(square(primitive(5), packed<char>({0, 1, 3, 2, 2}), 5121, 5)).mesh.triangles,
            (Triangles{{0, 1, 3}, {3, 1, 2}}));
  PolygonModel const points = parse(square(primitive(4) + "," + primitive(0), packed<char>({0, 1, 2}), 5121, 3));
  EXPECT_EQ(points.mesh.triangles.size(), 1u);
  ASSERT_EQ(points.notes.size(), 1u);
  EXPECT_NE(points.notes[0].find("points or lines"), std::string::npos);
}

TEST(GltfModel, BlendedMaskedAndTransmittingMaterialsAreTransparent) {
  std::string primitives = primitive(4);
  for (int i = 0; i < 4; ++i) primitives.append(",").append(primitive(4, fmt::format(R"(,"material":{})", i)));
  EXPECT_EQ(parse(square(primitives, packed<char>({0, 1, 2}), 5121, 3,
                         R"(,"materials":[{"alphaMode":"OPAQUE"},{"alphaMode":"BLEND"},{"alphaMode":"MASK"},)"
                         R"({"extensions":{"KHR_materials_transmission":{"transmissionFactor":0.5}}}])"))
                .transparent,
            (Flags{0, 0, 1, 1, 1}));
}

TEST(GltfModel, NodesPlaceAndMirror) {
  // −2 along x mirrors: triangles turn with it, so that the cube keeps its outside.
  std::string const nodes = R"("children":[1],"translation":[10,0,0],"rotation":[0,0,0.70710678,0.70710678]},)"
                            R"({"mesh":0,"scale":[-2,1,1])";
  PolygonModel const model = parse(glb(cube_gltf("", nodes), cube_gltf_buffer()));
  // (−1, −1, −1) is scaled to (2, −1, −1), turned to (1, 2, −1), moved to (11, 2, −1).
  EXPECT_TRUE(model.mesh.vertices[0].isApprox(Eigen::Vector3f(11, 2, -1), 1e-6f)) << model.mesh.vertices[0];
  double volume = 0;
  for (Eigen::Vector3i const& t : model.mesh.triangles)
    volume += model.mesh.vertices[t[0]].dot(model.mesh.vertices[t[1]].cross(model.mesh.vertices[t[2]])) / 6;
  EXPECT_NEAR(volume, 16, 1e-3);
  EXPECT_EQ(parse(glb(cube_gltf("", R"("mesh":0,"matrix":[1,0,0,0,0,1,0,0,0,0,1,0,5,6,7,1])"), cube_gltf_buffer()))
                .mesh.vertices[0],
            Eigen::Vector3f(4, 5, 6));
}

TEST(GltfModel, BuffersLieInTheTextOrBesideTheFile) {
  TemporaryFolder const folder;
  write_file(folder.path() / "cube data.bin", cube_gltf_buffer());
  for (char const* uri : {"cube%20data.bin", "./cube%20data.bin", "../cube%20data.bin"}) {
    write_file(folder.path() / "cube.gltf", cube_gltf(fmt::format(R"(,"uri":"{}")", uri)));
    EXPECT_EQ(read_polygon_model(folder.path() / "cube.gltf").mesh.vertices.size(), 8u) << uri;
  }
  write_file(folder.path() / "cube.gltf", cube_gltf(R"(,"uri":"none.bin")"));
  EXPECT_SCANVIEW_ERROR(read_polygon_model(folder.path() / "cube.gltf"), ErrorCode::bad_input, "none.bin");

  // Three vertices and no indices, 36 bytes in Base64 (1.0f is 00 00 80 3f).
  std::string const text =
      R"({"asset":{"version":"2.0"},"nodes":[{"mesh":0}],"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
      R"("accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}],"bufferViews":[{"buffer":0,)"
      R"("byteLength":36}],"buffers":[{"byteLength":36,"uri":"data:application/octet-stream;base64,)"
      R"(AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}]})";
  PolygonModel const model = parse_polygon_model(text, "a.gltf");
  EXPECT_EQ(model.mesh.vertices, (std::vector<Eigen::Vector3f>{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}));
  EXPECT_EQ(model.mesh.triangles, Triangles{Eigen::Vector3i(0, 1, 2)});
}

TEST(GltfModel, WhatCannotBeReadIsRefusedByName) {
  auto const refused = [](std::string const& bytes, char const* why) {
    EXPECT_SCANVIEW_ERROR(parse(bytes), ErrorCode::bad_input, why);
  };
  std::string const buffer = cube_gltf_buffer();
  refused(glb(cube_gltf("", R"("mesh":0,"children":[0])"), buffer), "two parents");
  refused(glb(cube_gltf("", R"("mesh":1)"), buffer), "");
  refused(glb(cube_gltf("", R"("mesh":-1)"), buffer), "'mesh'");
  refused(glb(cube_gltf(""), buffer.substr(0, 300)), "accessor 1");
  refused(glb(cube_gltf("", R"("mesh":0)", R"(,"extensionsRequired":["KHR_draco_mesh_compression"])"), buffer),
          "draco");
  refused(glb(R"({"asset":{"version":"1.0"}})", ""), "version");
  refused(glb(R"({"asset":)", ""), "JSON");
  refused(square(primitive(4), packed<char>({0, 1, 4}), 5121, 3), "vertex 4");
  refused(square(primitive(4), packed<char>({0, 1}), 5121, 2), "multiple of three");
  refused(square(primitive(4), packed<char>({0, 1, 2}), 5121, 2000000000), "more than there is");
  refused(square(primitive(4), packed<float>({0, 1, 0.5}), 5126, 3), "vertex -1");
}

TEST(GltfModel, ManyInstancesOfMuchAreRefusedBeforeMemoryEnds) {
  std::string const indices(30'000, '\0');
  std::string nodes = R"({"mesh":0})";
  for (int i = 1; i < 4000; ++i) nodes += R"(,{"mesh":0})";
  EXPECT_SCANVIEW_ERROR(parse(square(primitive(4), indices, 5121, 30'000, "", nodes)), ErrorCode::bad_input,
                        "instances");
}

}  // namespace
}  // namespace scanview
