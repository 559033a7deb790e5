#include <gtest/gtest.h>

#include <opencv2/core.hpp>

#include "base/files.h"
#include "synth/model_camera.h"
#include "synth/texture_lookup.h"
#include "tests/mesh/textured_files.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;
using Eigen::Vector3f;

/// What a camera before the square (0, 0) to (1, 1) sees of it, in n x n pixels.
cv::Mat3b seen(PolygonModel const& model, int n,
               ModelCameraOptions::Light const light = ModelCameraOptions::Light::painted) {
  ModelCameraOptions options;
  options.light = light;
  options.samples_side = 1;
  Context context;
  ModelCamera camera(model, options, context);
  Eigen::Isometry3d scene_from_camera = Eigen::Isometry3d::Identity();
  scene_from_camera.linear() = Vector3d(1, -1, -1).asDiagonal();
  scene_from_camera.translation() = Vector3d(0.5, 0.5, 2);
  return camera.picture(Camera::perspective(n, n, 2 * n, 2 * n, 0.5 * (n - 1), 0.5 * (n - 1)), scene_from_camera,
                        context);
}

int largest_difference(cv::Mat3b const& a, cv::Mat3b const& b) {
  EXPECT_EQ(a.size(), b.size());
  return static_cast<int>(cv::norm(a, b, cv::NORM_INF));
}

class TexturedModel : public ::testing::Test {
 protected:
  TexturedModel() {
    write_file(folder_.path() / "colors.png", four_colors_png());
    material("map_Kd colors.png");
  }
  void material(std::string const& map) const {
    write_file(folder_.path() / "square.mtl", "newmtl a\nKd 0.2 0.4 0.6\n" + map + "\n");
  }
  PolygonModel read(std::string const& name, std::string const& bytes, Winding winding = Winding::automatic) const {
    write_file(folder_.path() / name, bytes);
    PolygonModel model = read_polygon_model(folder_.path() / name, winding);
    EXPECT_NO_THROW(model.textures.check(model.mesh.triangles.size()));
    return model;
  }
  void expect_four_colors(std::string const& name, std::string const& bytes) const {
    for (Winding const winding : {Winding::keep, Winding::flip})
      EXPECT_LE(largest_difference(seen(read(name, bytes, winding), 2), four_colors()), 1) << bytes;
  }

  TemporaryFolder folder_;
};

TEST_F(TexturedModel, ObjPicturesAreTheRightWayRound) {
  for (char const* faces :
       {"f 1/1 2/2/1 3/3 4/4\n", "f -4/-4 -3/-3/-1 -2/-2 -1/-1\n", "f 3/3 4/4 1/1\nf 1/1 2/2 3/3\n"})
    expect_four_colors("a.obj", square_obj(1, faces));
  material("map_Kd -blendu on -mm 0 1 -s 0.5 0.5 -o 0 0 0 colors.png");
  expect_four_colors("a.obj", square_obj(2));
}

TEST_F(TexturedModel, PlyPicturesAreTheRightWayRound) {
  for (auto const& [u, v] : {std::pair{"s", "t"}, {"u", "v"}, {"texture_u", "texture_v"}})
    expect_four_colors("a.ply", square_ply_by_vertex(u, v));
  expect_four_colors("a.ply", square_ply_by_face());
  std::string strip = square_ply_by_vertex("s", "t");
  strip.replace(strip.find("element face"), 12, "element tristrips");
  strip.replace(strip.find("4 0 1 2 3"), 9, "4 0 1 3 2");
  expect_four_colors("a.ply", strip);
}

TEST_F(TexturedModel, GltfPicturesAreTheRightWayRoundInEveryKindOfCoordinate) {
  expect_four_colors("a.glb", SquareGltf{}.bytes());
  expect_four_colors("a.glb", SquareGltf{.texture_info = R"("index":0,"texCoord":1)"}.bytes());
  expect_four_colors("a.glb", SquareGltf{.image = R"("uri":"colors.png")"}.bytes());
  expect_four_colors(
      "a.glb", SquareGltf{.image = R"("uri":"data:image/png;base64,)" + base64(four_colors_png()) + "\""}.bytes());
  char const top = '\xff';
  expect_four_colors("a.glb", SquareGltf{.coordinates = {0, top, top, top, top, 0, 0, 0},
                                         .coordinate_type = R"("componentType":5121,"normalized":true)"}
                                  .bytes());
  expect_four_colors("a.glb",
                     SquareGltf{.coordinates = packed<unsigned short>({0, 65535, 65535, 65535, 65535, 0, 0, 0}),
                                .coordinate_type = R"("componentType":5123,"normalized":true)"}
                         .bytes());
}

TEST_F(TexturedModel, GltfMirrorsAndTransformsCarryTheirPictures) {
  cv::Mat3b mirrored(2, 2), turned(2, 2);
  mirrored << kGreen, kRed, kGray, kBlue;
  EXPECT_LE(
      largest_difference(
          seen(read("a.glb", SquareGltf{.node = R"("mesh":0,"scale":[-1,1,1],"translation":[1,0,0])"}.bytes()), 2),
          mirrored),
      1);
  // Coordinates turn by a quarter against the clock, so the picture turns with it.
  turned << kBlue, kRed, kGray, kGreen;
  std::string const quarter =
      R"("index":0,"extensions":{"KHR_texture_transform":{"rotation":1.5707963267948966,"offset":[0,1]}})";
  EXPECT_LE(largest_difference(seen(read("a.glb", SquareGltf{.texture_info = quarter}.bytes()), 2), turned), 1);
}

TEST_F(TexturedModel, PicturesGoOnBeyondTheirEdgesAsTheyAreToldTo) {
  cv::Mat3b repeated(4, 4), mirrored(4, 4), clamped(4, 4);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) {
      constexpr int kMirrored[] = {0, 1, 1, 0};
      repeated(y, x) = four_colors()(y % 2, x % 2);
      mirrored(y, x) = four_colors()(kMirrored[y], kMirrored[x]);
      clamped(y, x) = four_colors()(std::min(y, 1), std::min(x, 1));
    }
  SquareGltf square{.coordinates = packed<float>({0, 2, 2, 2, 2, 0, 0, 0})};
  EXPECT_LE(largest_difference(seen(read("a.glb", square.bytes()), 4), repeated), 1);
  square.sampler = R"({"wrapS":10497,"wrapT":10497})";
  EXPECT_LE(largest_difference(seen(read("a.glb", square.bytes()), 4), repeated), 1);
  square.sampler = R"({"wrapS":33648,"wrapT":33648})";
  EXPECT_LE(largest_difference(seen(read("a.glb", square.bytes()), 4), mirrored), 1);
  square.sampler = R"({"wrapS":33071,"wrapT":33071})";
  EXPECT_LE(largest_difference(seen(read("a.glb", square.bytes()), 4), clamped), 1);

  EXPECT_LE(largest_difference(seen(read("a.obj", square_obj(2)), 4), repeated), 1);
  material("map_Kd -clamp on colors.png");
  cv::Mat3b clamped_above(4, 4);  // v is up
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x) clamped_above(y, x) = four_colors()(std::max(y - 2, 0), std::min(x, 1));
  EXPECT_LE(largest_difference(seen(read("a.obj", square_obj(2)), 4), clamped_above), 1);
}

TEST_F(TexturedModel, FactorsMultiplyInLinearLight) {
  PolygonModel const model = read("a.glb", SquareGltf{.base = R"(,"baseColorFactor":[0.5,0.25,1,1])"}.bytes());
  cv::Mat3b const picture = seen(model, 2);
  // sRGB of 0.5 and 0.25 is 188 and 137; 128 is 0.2159 linear, its half 92, its quarter 66.
  cv::Mat3b expected(2, 2);
  expected << cv::Vec3b(0, 0, 188), cv::Vec3b(0, 137, 0), cv::Vec3b(255, 0, 0), cv::Vec3b(128, 66, 92);
  EXPECT_LE(largest_difference(picture, expected), 1);
}

TEST(TextureLookup, BetweenPixelCentresIsTheMeanInLinearLight) {
  ModelTexture texture{.picture = four_colors(), .wrap_u = TextureWrap::clamp, .wrap_v = TextureWrap::clamp};
  float const gray = 0.21586f;
  EXPECT_TRUE(texture_color(texture, {0.5f, 0.25f}).isApprox(Vector3f(0.5f, 0.5f, 0), 1e-5f));
  EXPECT_TRUE(texture_color(texture, {0.5f, 0.5f}).isApprox(Vector3f(1 + gray, 1 + gray, 1 + gray) / 4, 1e-4f));
  EXPECT_TRUE(texture_color(texture, {-7, 1e30f}).isApprox(Vector3f(0, 0, 1), 1e-6f));
  for (TextureWrap const wrap : {TextureWrap::repeat, TextureWrap::clamp, TextureWrap::mirrored})
    for (float const at : {-1e30f, -3.0f, -1e-9f, 0.0f, 1.0f, 2.0f, 1e30f}) {
      texture.wrap_u = texture.wrap_v = wrap;
      Vector3f const color = texture_color(texture, {at, -at});
      EXPECT_TRUE((color.array() >= 0 && color.array() <= 1).all()) << at;
    }
}

TEST_F(TexturedModel, BakedLightMultipliesThePicture) {
  PolygonModel textured = read("a.obj", square_obj()), plain = textured;
  for (ModelTexture& texture : textured.textures.textures) texture.picture = cv::Mat3b(2, 2, cv::Vec3b(90, 140, 200));
  plain.textures = {};
  plain.mesh.colors.assign(4, cv::Vec3b(90, 140, 200));
  auto const baked = ModelCameraOptions::Light::baked;
  cv::Mat3b const expected = seen(plain, 8, baked);
  EXPECT_LE(largest_difference(seen(textured, 8, baked), expected), 1);
  EXPECT_GT(largest_difference(expected, seen(plain, 8)), 5) << "the light does something";
}

TEST_F(TexturedModel, FacesOfSeveralPlainColoursKeepTheirOwn) {
  write_file(folder_.path() / "square.mtl", "newmtl a\nKd 1 0 0\nnewmtl b\nKd 0 0 1\n");
  PolygonModel const model = read("a.obj", square_obj(1, "f 1 2 3\nusemtl b\nf 1 3 4\n"));
  EXPECT_EQ(model.mesh.vertices.size(), 4u);
  cv::Mat3b const picture = seen(model, 16);
  for (int y = 0; y < 16; ++y)
    for (int x = 0; x < 16; ++x)
      if (x != 15 - y) {
        EXPECT_EQ(picture(y, x), x > 15 - y ? kRed : kBlue) << x << " " << y;
      }
}

}  // namespace
}  // namespace scanview
