#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <initializer_list>
#include <string>
#include <vector>

namespace scanview {

// The cube from (−1, −1, −1) to (1, 1, 1), six squares, in every format.

inline std::array<std::array<int, 3>, 8> const kCubeCorners = {
    {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}}};
inline std::array<std::array<int, 4>, 6> const kCubeFaces = {
    {{0, 3, 2, 1}, {4, 5, 6, 7}, {0, 1, 5, 4}, {1, 2, 6, 5}, {2, 3, 7, 6}, {3, 0, 4, 7}}};
inline std::array<std::array<int, 3>, 2> const kHalves = {{{0, 1, 2}, {0, 2, 3}}};

/// Numbers of one type, the lowest byte first or last.
template <typename Number>
std::string packed(std::initializer_list<Number> numbers, bool big = false) {
  std::string bytes;
  for (Number const number : numbers) {
    char raw[sizeof number];
    std::memcpy(raw, &number, sizeof raw);
    if (big) std::reverse(raw, raw + sizeof raw);
    bytes.append(raw, sizeof raw);
  }
  return bytes;
}

inline std::string cube_rows(char const* format, char const* face_format = "", int first = 0) {
  std::string text;
  for (auto const& p : kCubeCorners) text += fmt::format(fmt::runtime(format), p[0], p[1], p[2]);
  for (auto const& f : kCubeFaces)
    text += fmt::format(fmt::runtime(face_format), f[0] + first, f[1] + first, f[2] + first, f[3] + first);
  return text;
}

inline std::string cube_ply() {
  return "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
         "element face 6\nproperty list uchar int vertex_indices\nend_header\n" +
         cube_rows("{} {} {}\n", "4 {} {} {} {}\n");
}
inline std::string cube_obj() { return cube_rows("v {} {} {}\n", "f {} {} {} {}\n", 1); }
inline std::string cube_off() { return "# a cube\nOFF\n\n8 6 12\n" + cube_rows("{} {} {}\n", "4 {} {} {} {}\n"); }
inline std::string cube_off_binary() {
  std::string bytes = "OFF BINARY\n" + packed<int>({8, 6, 12}, true);
  for (auto const& p : kCubeCorners) bytes += packed<float>({float(p[0]), float(p[1]), float(p[2])}, true);
  for (auto const& f : kCubeFaces) bytes += packed<int>({4, f[0], f[1], f[2], f[3], 0}, true);
  return bytes;
}
inline std::string cube_stl() {
  std::string text = "solid cube\n";
  for (auto const& face : kCubeFaces)
    for (auto const& half : kHalves) {
      text += " facet normal 0 0 0\n  outer loop\n";
      for (int const k : half) {
        auto const& p = kCubeCorners[face[k]];
        text += fmt::format("   vertex {} {} {:e}\n", p[0], p[1], double(p[2]));
      }
      text += "  endloop\n endfacet\n";
    }
  return text + "endsolid cube\n";
}
inline std::string cube_stl_binary() {
  std::string bytes = "solid, says the header of this binary file";
  bytes.resize(80, ' ');
  bytes += packed<unsigned>({12});
  for (auto const& face : kCubeFaces)
    for (auto const& half : kHalves) {
      bytes += packed<float>({0, 0, 0});
      for (int const k : half)
        for (int const x : kCubeCorners[face[k]]) bytes += packed<float>({float(x)});
      bytes += packed<short>({0});
    }
  return bytes;
}
inline std::string cube_mni() {
  std::string text = "P 0.3 0.3 0.4 10 1 8\n" + cube_rows(" {} {} {}\n") + cube_rows(" {} {} {}\n");
  text += "\n6\n 0 1 1 1 1\n\n 4 8 12 16\n 20 24\n\n";
  for (auto const& f : kCubeFaces) text += fmt::format(" {} {} {} {}\n", f[0], f[1], f[2], f[3]);
  return text;
}
inline std::string cube_freesurfer() {
  std::string bytes =
      "\xff\xff\xfe"
      "created by hand\n\n" +
      packed<int>({8, 12}, true);
  for (auto const& p : kCubeCorners) bytes += packed<float>({float(p[0]), float(p[1]), float(p[2])}, true);
  for (auto const& face : kCubeFaces)
    for (auto const& half : kHalves) bytes += packed<int>({face[half[0]], face[half[1]], face[half[2]]}, true);
  return bytes;
}

/// Four vertices a square, as glTF must have them for normals; indices are 16 bits.
inline std::string cube_gltf_buffer() {
  std::string bytes;
  for (auto const& face : kCubeFaces)
    for (int const v : face)
      for (int const x : kCubeCorners[v]) bytes += packed<float>({float(x)});
  for (short f = 0; f < 6; ++f)
    for (auto const& half : kHalves)
      for (int const k : half) bytes += packed<short>({short(4 * f + k)});
  return bytes;
}
inline std::string cube_gltf(std::string const& buffer_fields, std::string const& node_fields = R"("mesh":0)",
                             std::string const& more = "") {
  return R"({"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],"nodes":[{)" + node_fields +
         R"(}],"meshes":[{"primitives":[{"attributes":{"POSITION":0},"indices":1}]}],"accessors":[)"
         R"({"bufferView":0,"componentType":5126,"count":24,"type":"VEC3"},)"
         R"({"bufferView":1,"componentType":5123,"count":36,"type":"SCALAR"}],"bufferViews":[)"
         R"({"buffer":0,"byteLength":288},{"buffer":0,"byteOffset":288,"byteLength":72}],"buffers":[{"byteLength":360)" +
         buffer_fields + "}]" + more + "}";
}
inline std::string glb(std::string json, std::string const& binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  return "glTF" + packed<unsigned>({2, unsigned(28 + json.size() + binary.size()), unsigned(json.size())}) + "JSON" +
         json + packed<unsigned>({unsigned(binary.size())}) + std::string("BIN\0", 4) + binary;
}
inline std::string cube_glb() { return glb(cube_gltf(""), cube_gltf_buffer()); }

struct ModelFile {
  char const* name;
  std::string (*bytes)();
  std::size_t polygons;  ///< of the cube in this format
};

inline std::vector<ModelFile> const kModelFiles = {
    {"cube.ply", cube_ply, 6},          {"cube.obj", cube_obj, 6},        {"cube.off", cube_off, 6},
    {"binary.off", cube_off_binary, 6}, {"cube.stl", cube_stl, 12},       {"binary.stl", cube_stl_binary, 12},
    {"mni.obj", cube_mni, 6},           {"lh.cube", cube_freesurfer, 12}, {"cube.glb", cube_glb, 12}};

}  // namespace scanview
