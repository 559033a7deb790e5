#include "mesh/node_mesh_file.h"

#include <fmt/format.h>

#include <cmath>

#include "acquire/json_vector.h"
#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"
#include "base/json_fields.h"
#include "mesh/mesh_ply.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

constexpr int kFormat = 1;
constexpr int kMostSides = 1000, kMostTriangles = 1 << 28;

[[noreturn]] void bad(fs::path const& path, std::string const& what) { throw Error(ErrorCode::bad_input, path, what); }

Eigen::Matrix3d rotation_from_json(Json const& json, std::string const& key, fs::path const& path) {
  if (!json.is_array() || json.size() != 9) bad(path, key + ": must be nine numbers, row by row");
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  for (int i = 0; i < 9; ++i) m(i / 3, i % 3) = json_finite(json[i], key, path);
  Eigen::Isometry3d const exact = pose_from_matrix(m, path, key);
  // Shared edges are found by equal rays: what is a rotation to rounding stays as it was written.
  bool const is_exact = (exact.linear() - m.topLeftCorner<3, 3>()).cwiseAbs().maxCoeff() < 1e-12;
  return is_exact ? Eigen::Matrix3d(m.topLeftCorner<3, 3>()) : Eigen::Matrix3d(exact.linear());
}

}  // namespace

void write_node_mesh(fs::path const& folder, NodeMesh const& node) {
  node.check();
  NewFolder output(folder);
  Json json;
  json["format"] = kFormat;
  json["position"] = vector_to_json(node.position);
  json["parallax_px"] = node.parallax_px;
  json["sides"] = Json::array();
  for (std::size_t s = 0; s < node.sides.size(); ++s) {
    NodeMesh::Side const& side = node.sides[s];
    Json rotation = Json::array();
    for (int i = 0; i < 9; ++i) rotation.push_back(side.node_from_camera(i / 3, i % 3));
    json["sides"].push_back({{"camera", side.camera.to_json()},
                             {"node_from_camera", rotation},
                             {"triangles", side.end - side.first},
                             {"panes", side.end_pane - side.first_pane}});
    write_file(output.path() / fmt::format("color_{}.png", s), encode_png(side.color));
    write_file(output.path() / fmt::format("feather_{}.png", s), encode_png(side.feather));
  }
  PlyFile ply = ply_from_mesh({node.vertices, node.triangles, {}});
  ply.comments.push_back("node coordinates: the scene's axes, the node's position at the origin; side after side");
  ply.elements[1].properties.push_back(
      ply_scalar("quality", PlyType::float32, {node.quality.begin(), node.quality.end()}));
  write_file(output.path() / "mesh.ply", format_ply(ply, PlyFormat::binary_little_endian));
  if (!node.panes.triangles.empty())
    write_file(output.path() / "panes.ply", format_ply(ply_from_mesh(node.panes), PlyFormat::binary_little_endian));
  write_json(output.path() / "node.json", json);
  output.commit();
}

NodeMesh read_node_mesh(fs::path const& folder) {
  fs::path const path = folder / "node.json", mesh_path = folder / "mesh.ply";
  Json const json = read_json(path);
  refuse_unknown_keys(json, {"format", "position", "parallax_px", "sides"}, "", path);
  if (json_integer(json_member(json, "format", path), "format", 0, 1 << 30, path) != kFormat)
    bad(path, "format: only 1 is known");
  NodeMesh node;
  node.position = vector_from_json(json_member(json, "position", path), "position", path);
  node.parallax_px = json_finite(json_member(json, "parallax_px", path), "parallax_px", path);
  Json const& sides = json_member(json, "sides", path);
  if (!sides.is_array() || sides.empty() || sides.size() > kMostSides) bad(path, "sides: must be a list of sides");
  for (std::size_t s = 0; s < sides.size(); ++s) {
    refuse_unknown_keys(sides[s], {"camera", "node_from_camera", "triangles", "panes"}, fmt::format("sides[{}]", s),
                        path);
    NodeMesh::Side side;
    side.camera = Camera::from_json(json_member(sides[s], "camera", path), path);
    if (!side.camera.is_perspective()) bad(path, "camera: must be perspective");
    side.node_from_camera =
        rotation_from_json(json_member(sides[s], "node_from_camera", path), "node_from_camera", path);
    side.first = s > 0 ? node.sides.back().end : 0;
    side.end = side.first + std::size_t(json_integer(json_member(sides[s], "triangles", path), "triangles", 0,
                                                     kMostTriangles, path));
    side.first_pane = s > 0 ? node.sides.back().end_pane : 0;
    side.end_pane = side.first_pane +
                    std::size_t(json_integer(json_member(sides[s], "panes", path), "panes", 0, kMostTriangles, path));
    fs::path const color = folder / fmt::format("color_{}.png", s), feather = folder / fmt::format("feather_{}.png", s);
    side.color = read_color(color);
    side.feather = read_gray(feather);
    for (auto const& [picture, file] : {std::pair(side.color.size(), color), std::pair(side.feather.size(), feather)})
      if (picture != cv::Size(side.camera.width(), side.camera.height()))
        bad(file, fmt::format("{} x {} pixels, but the camera has {} x {}", picture.width, picture.height,
                              side.camera.width(), side.camera.height()));
    node.sides.push_back(std::move(side));
  }
  PlyFile const ply = read_ply(mesh_path);
  TriangleMesh mesh = model_from_ply(ply, mesh_path).mesh;
  node.vertices = std::move(mesh.vertices);
  node.triangles = std::move(mesh.triangles);
  PlyElement const* const faces = ply.find("face");
  PlyProperty const* const quality = faces ? faces->find("quality") : nullptr;
  if (!quality || quality->is_list) bad(mesh_path, "faces without 'quality'");
  if (quality->values.size() != node.triangles.size()) bad(mesh_path, "faces that are not all triangles");
  if (node.sides.back().end != node.triangles.size())
    bad(mesh_path, fmt::format("{} triangles, but node.json names {}", node.triangles.size(), node.sides.back().end));
  if (node.sides.back().end_pane > 0) {
    fs::path const panes_path = folder / "panes.ply";
    node.panes = model_from_ply(read_ply(panes_path), panes_path).mesh;
    if (node.sides.back().end_pane != node.panes.triangles.size())
      bad(panes_path,
          fmt::format("{} triangles, but node.json names {}", node.panes.triangles.size(), node.sides.back().end_pane));
  }
  for (double const value : quality->values) {
    if (!(value >= 0 && value <= 1)) bad(mesh_path, "a 'quality' that is not between 0 and 1");
    node.quality.push_back(float(value));
  }
  node.check();
  return node;
}

}  // namespace scanview
