#pragma once
#include <fmt/format.h>

#include <opencv2/core/mat.hpp>
#include <string>

#include "base/image_file.h"
#include "tests/mesh/model_files.h"

namespace scanview {

// The square from (0, 0, 0) to (1, 1, 0), seen from +z, y up, with a picture of 2 x 2 pixels on it.

inline cv::Vec3b const kRed{0, 0, 255}, kGreen{0, 255, 0}, kBlue{255, 0, 0}, kGray{128, 128, 128};

/// Red, green; blue, gray.
inline cv::Mat3b four_colors() {
  cv::Mat3b picture(2, 2);
  picture << kRed, kGreen, kBlue, kGray;
  return picture;
}
inline std::string four_colors_png() { return encode_png(four_colors()); }

/// Needs square.mtl. Texture coordinates go from 0 to `most`.
inline std::string square_obj(double most = 1, std::string const& faces = "f 1/1 2/2/1 3/3 4/4\n") {
  return fmt::format(
      "mtllib square.mtl\nvt 0 0\nvt {0} 0\nvt {0} {0} 0\nvt 0 {0}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
      "vn 0 0 1\nusemtl a\n{1}",
      most, faces);
}

inline std::string const kPlyPictures = "comment made by hand\ncomment TextureFile colors.png\n";
inline std::string square_ply_by_vertex(std::string const& u, std::string const& v) {
  return "ply\nformat ascii 1.0\n" + kPlyPictures +
         "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nproperty float " + u +
         "\nproperty float " + v +
         "\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n"
         "0 0 0 0 0\n1 0 0 1 0\n1 1 0 1 1\n0 1 0 0 1\n4 0 1 2 3\n";
}
inline std::string square_ply_by_face(std::string const& number = "0", std::string const& first = "0 0") {
  return "ply\nformat ascii 1.0\n" + kPlyPictures +
         "element vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 2\n"
         "property list uchar int vertex_indices\nproperty list uchar float texcoord\nproperty int texnumber\n"
         "end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 1 2 3 6 1 0 1 1 0 1 0\n3 3 0 1 6 0 1 " +
         first + " 1 0 " + number + "\n";
}

struct SquareGltf {
  std::string image = {};                   ///< fields of the image; empty: a buffer view with `picture`
  std::string picture = four_colors_png();  ///< a file's bytes
  std::string coordinates = packed<float>({0, 1, 1, 1, 1, 0, 0, 0});
  std::string coordinate_type = R"("componentType":5126)";
  std::string texture_info = R"("index":0)";
  std::string base = {};  ///< more fields of pbrMetallicRoughness
  std::string sampler = "{}";
  std::string node = R"("mesh":0)";

  /// A GLB file of two triangles over the vertices (0, 0), (1, 0), (1, 1), (0, 1), in that order.
  std::string bytes() const {
    std::string const positions = packed<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
    std::string const indices = packed<short>({0, 1, 2, 0, 2, 3});
    std::string const buffer = positions + coordinates + indices + picture;
    std::string json = R"({"asset":{"version":"2.0"},"nodes":[{NODE}],"meshes":[{"primitives":[{"material":0,)"
                       R"("attributes":{"POSITION":0,"TEXCOORD_0":1,"TEXCOORD_1":1},"indices":2}]}],)"
                       R"("materials":[{"pbrMetallicRoughness":{"baseColorTexture":{INFO}BASE}}],)"
                       R"("textures":[{"source":0,"sampler":0}],"samplers":[SAMPLER],"images":[{IMAGE}],"accessors":[)"
                       R"({"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},)"
                       R"({"bufferView":1,TYPE,"count":4,"type":"VEC2"},)"
                       R"({"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}],"bufferViews":[VIEWS],)"
                       R"("buffers":[{"byteLength":LENGTH}]})";
    std::string views;
    std::size_t at = 0;
    for (std::string const& part : {positions, coordinates, indices, picture}) {
      views += fmt::format(R"({}{{"buffer":0,"byteOffset":{},"byteLength":{}}})", at > 0 ? "," : "", at, part.size());
      at += part.size();
    }
    auto const fill = [&json](std::string const& key, std::string const& value) {
      json.replace(json.find(key), key.size(), value);
    };
    fill("NODE", node);
    fill("INFO", texture_info);
    fill("BASE", base);
    fill("SAMPLER", sampler);
    fill("IMAGE", image.empty() ? R"("bufferView":3,"mimeType":"image/png")" : image);
    fill("TYPE", coordinate_type);
    fill("VIEWS", views);
    fill("LENGTH", std::to_string(buffer.size()));
    return glb(json, buffer);
  }
};

inline std::string base64(std::string const& bytes) {
  constexpr char const* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  unsigned bits = 0;
  int count = 0;
  for (char const c : bytes) {
    bits = bits << 8 | static_cast<unsigned char>(c);
    for (count += 8; count >= 6; count -= 6) text.push_back(kDigits[bits >> (count - 6) & 63]);
  }
  if (count > 0) text.push_back(kDigits[bits << (6 - count) & 63]);
  return text;
}

}  // namespace scanview
