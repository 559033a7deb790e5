#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <iostream>
#include <map>
#include <memory>

#include "acquire/archive.h"
#include "acquire/capture.h"
#include "acquire/import.h"
#include "acquire/json_vector.h"
#include "acquire/rgbd_manifest.h"
#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/image_file.h"
#include "base/ply.h"
#include "cli/ldi_figures.h"
#include "cli/session.h"
#include "mesh/triangle_mesh.h"
#include "viewer/layered/ldi_file.h"
#include "viewer/walkthrough/walkthrough_file.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

Json info_scan_set(fs::path const& folder, Context& context) {
  ScanSet const set = read_scan_set(folder, context);
  Json info = {{"kind", "scan set"}, {"unit", to_string(set.unit)}, {"views", Json::array()}};
  for (auto const& view : set.views)
    info["views"].push_back({{"name", view.name},
                             {"width", view.image.camera.width()},
                             {"height", view.image.camera.height()},
                             {"model", view.image.camera.is_perspective() ? "perspective" : "orthographic"},
                             {"depths", view.image.count_depths()},
                             {"pose", view.object_from_camera.has_value()},
                             {"mesh", fs::exists(folder / view_folder(view.name) / "mesh.ply")}});
  info["center"] = {set.center.x(), set.center.y(), set.center.z()};
  info["radius"] = set.radius();
  info["threshold"] = set.error_budget.threshold();
  Json stages = Json::array();
  for (char const* stage : {"synth", "import", "acquire", "register", "mesh", "render", "evaluate"})
    if (fs::exists(folder / (std::string(stage) + ".json"))) stages.push_back(stage);
  info["stages"] = stages;
  return info;
}

Json info_ply(fs::path const& path) {
  PlyFile const ply = read_ply(path);
  Json info = {{"kind", "PLY"}, {"elements", Json::array()}};
  for (auto const& element : ply.elements) {
    Json properties = Json::array();
    for (auto const& property : element.properties)
      properties.push_back(property.is_list ? property.name + "[]" : property.name);
    info["elements"].push_back({{"name", element.name}, {"rows", element.rows}, {"properties", properties}});
  }
  if (!ply.obj_info.empty()) info["obj_info"] = ply.obj_info;
  return info;
}

Json info_exr(fs::path const& path) {
  cv::Mat1f const depth = read_depth_exr(path);
  float low = std::numeric_limits<float>::infinity(), high = -low;
  std::size_t count = 0;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x)
      if (std::isfinite(depth(y, x))) low = std::min(low, depth(y, x)), high = std::max(high, depth(y, x)), ++count;
  return {{"kind", "range image"}, {"width", depth.cols},         {"height", depth.rows},
          {"depths", count},       {"nearest", json_number(low)}, {"farthest", json_number(high)}};
}

/// The header of a binary glTF (specification 2.0, section 4.4) and what its JSON says there is.
Json info_glb(fs::path const& path) {
  std::string const bytes = read_file(path);
  auto const word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, sizeof value);
    return value;
  };
  if (bytes.size() < 20 || bytes.compare(0, 4, "glTF") != 0 || word(8) != bytes.size() || word(12) > bytes.size() - 20)
    throw Error(ErrorCode::bad_input, path, "is truncated or no binary glTF");
  Json const gltf = Json::parse(bytes.substr(20, word(12)), nullptr, false);
  if (!gltf.is_object()) throw Error(ErrorCode::bad_input, path, "has no valid glTF JSON");
  auto const count = [&](char const* key) { return gltf.value(key, Json::array()).size(); };
  return {{"kind", "binary glTF"},     {"bytes", bytes.size()},     {"nodes", count("nodes")},
          {"meshes", count("meshes")}, {"images", count("images")}, {"accessors", count("accessors")}};
}

Json info_rgbd(fs::path const& path) {
  RgbdSource const source = read_rgbd_manifest(path);
  bool poses = !source.frames.empty();
  for (auto const& frame : source.frames) poses = poses && (frame.pose || frame.pose_file);
  return {{"kind", "colour and depth frames"},       {"frames", source.frames.size()},
          {"unit", to_string(source.unit)},          {"depth_unit", source.depth_unit},
          {"camera", source.color.camera.to_json()}, {"poses", poses},
          {"fixed_camera", source.fixed_camera}};
}

Json info_capture(fs::path const& path) {
  Capture const capture = read_capture(path, path.parent_path());
  bool const gray = capture.pattern == Capture::Pattern::gray;
  std::size_t missing = 0;
  for (auto const& view : capture.views)
    for (Side const side : kSides)
      for (int k = 0; k < capture.frame_count(); ++k)
        if (!fs::exists(capture.frame_path(view, side, k))) ++missing;
  Json info = {{"kind", "capture"},
               {"pattern", gray ? "gray" : "sweep"},
               {"views", capture.views.size()},
               {"frames", capture.frame_count()},
               {"missing_frames", missing},
               {"color", capture.color.has_value()},
               {"empty_scene", capture.empty.has_value()},
               {"backdrop", capture.backdrop.has_value()},
               {"rig", capture.rig.has_value()},
               {"intrinsics", capture.intrinsics.has_value()}};
  if (gray) info.update({{"bits", capture.bits}, {"row_bits", capture.row_bits}});
  fs::path const first = capture.frame_path(capture.views.front(), Side::left, 0);
  if (fs::exists(first)) {
    cv::Size const size = read_image(first).size();
    info["width"] = size.width;
    info["height"] = size.height;
    if (capture.rig) {
      StereoRig const rig = read_stereo_rig(capture.folder / *capture.rig, size);
      info["baseline"] = rig.baseline();
      info["unit"] = rig.unit;
    }
  }
  return info;
}

Json info_json(fs::path const& path) {
  if (path.filename() == "capture.json") return info_capture(path);
  if (path.filename() == "rgbd.json") return info_rgbd(path);
  Json const json = read_json(path);
  Json info = {{"kind", "JSON"}};
  if (json.is_object() && json.contains("stage") && json.contains("figures"))
    info = {{"kind", "record of a stage"},
            {"stage", json["stage"]},
            {"version", json.value("version", Json())},
            {"figures", json["figures"]}};
  else if (json.is_object() && json.contains("frames"))
    info = {{"kind", "nerfstudio transforms"}, {"frames", json["frames"].size()}};
  else if (json.is_object() && json.contains("keyframes"))
    info = {{"kind", "camera path"}, {"keyframes", json["keyframes"].size()}};
  else if (json.is_object())
    for (auto const& [key, value] : json.items()) info["keys"].push_back(key);
  return info;
}

Json info_mesh(fs::path const& path) {
  TriangleMesh const mesh = read_triangle_mesh(path);
  return {{"kind", "triangle mesh"},
          {"vertices", mesh.vertices.size()},
          {"triangles", mesh.triangles.size()},
          {"colors", !mesh.colors.empty()}};
}

Json info_archive(fs::path const& path) {
  Json names = Json::array();
  read_archive(path, [&](std::string const& name) { return names.push_back(name), false; });
  return {{"kind", "archive"}, {"import", guess_import_kind(path)}, {"files", names}};
}

Json info_walkthrough(fs::path const& folder) {
  WalkthroughManifest const manifest = read_walkthrough(folder);
  Json nodes = Json::array();
  for (auto const& node : manifest.nodes)
    nodes.push_back({{"name", node.name},
                     {"position", {node.position.x(), node.position.y(), node.position.z()}},
                     {"triangles", node.triangles},
                     {"parallax_px", node.parallax_px},
                     {"levels", node.levels.size()}});
  return {{"kind", "walkthrough"},
          {"unit", to_string(manifest.unit)},
          {"walking_radius", manifest.walking_radius},
          {"nodes", nodes}};
}

Json info_ldi(fs::path const& path) {
  LdiTree const tree = read_ldi(path);
  Json info = {{"kind", "LDI tree"},
               {"unit", to_string(tree.unit)},
               {"resolution", tree.options.resolution},
               {"coarseness", tree.options.coarseness},
               {"center", vector_to_json(tree.center)},
               {"radius", tree.radius},
               {"file_bytes", fs::file_size(path)},
               {"input_pixels", tree.input_pixels}};
  Json size = ldi_size(tree);
  size.erase("levels");
  info.update(size);
  std::map<int, std::pair<std::size_t, std::size_t>> levels;  // cells, pixels
  for (LdiCell const& cell : tree.cells) {
    levels[cell.key.level].first += 1;
    levels[cell.key.level].second += cell.pixels;
  }
  info["levels"] = Json::array();
  for (auto const& [level, counts] : levels)
    info["levels"].push_back({{"step", ldi_step(level)}, {"cells", counts.first}, {"pixels", counts.second}});
  info["views"] = Json::array();
  for (View const& view : tree.views)
    info["views"].push_back({{"name", view.name},
                             {"width", view.image.camera.width()},
                             {"height", view.image.camera.height()},
                             {"model", view.image.camera.is_perspective() ? "perspective" : "orthographic"}});
  return info;
}

Json info(fs::path const& path, Context& context) {
  if (!fs::exists(path)) throw Error(ErrorCode::bad_input, path, "does not exist");
  if (fs::is_directory(path)) {
    if (fs::exists(path / "scanset.json")) return info_scan_set(path, context);
    if (is_walkthrough(path)) return info_walkthrough(path);
    if (is_capture(path)) return info_capture(path / "capture.json");
    if (fs::exists(path / "rgbd.json")) return info_rgbd(path / "rgbd.json");
    std::string const kind = guess_import_kind(path);
    if (kind.empty())
      throw Error(ErrorCode::bad_input, path, "is no folder that can be read (no scan set, no known layout)");
    return {{"kind", "folder"}, {"import", kind}};
  }
  std::string const name = path.filename().string();
  auto const ends = [&](std::string_view ending) { return name.ends_with(ending); };
  if (name == "scanset.json") return info_scan_set(path.parent_path(), context);
  if (ends(".ldi") || is_ldi(path)) return info_ldi(path);
  if (ends(".ply")) return info_ply(path);
  if (ends(".obj") || ends(".obj.gz") || ends(".ply.gz")) return info_mesh(path);
  if (ends(".exr")) return info_exr(path);
  if (ends(".glb")) return info_glb(path);
  if (ends(".json")) return info_json(path);
  if (ends(".conf")) return {{"kind", "Stanford poses"}, {"import", guess_import_kind(path)}};
  if (is_archive(path)) return info_archive(path);
  if (ends(".png") || ends(".jpg") || ends(".jpeg")) {
    cv::Mat const image = read_image(path);
    return {{"kind", "picture"},
            {"width", image.cols},
            {"height", image.rows},
            {"channels", image.channels()},
            {"bits", image.depth() == CV_8U ? 8 : 16}};
  }
  throw Error(ErrorCode::bad_input, path, "is of no kind that scanview reads or writes");
}

void print(Json const& json, std::string const& indent) {
  for (auto const& [key, value] : json.items()) {
    bool const is_table = value.is_array() && !value.empty() && value[0].is_object();
    if (value.is_object()) {
      std::cout << indent << key << ":\n";
      print(value, indent + "  ");
    } else if (is_table) {
      std::cout << indent << key << ":\n";
      for (auto const& row : value) std::cout << indent << "  " << row.dump() << '\n';
    } else {
      std::cout << fmt::format("{}{}: {}\n", indent, key, value.is_string() ? value.get<std::string>() : value.dump());
    }
  }
}

}  // namespace

void add_info(CLI::App& app, Session& session) {
  auto path = std::make_shared<fs::path>();
  CLI::App* verb = app.add_subcommand("info", "What is in a file or folder");
  verb->add_option("path", *path,
                   "Scan set, LDI tree, capture, frames, mesh, picture, range image, record, archive ...")
      ->required();
  verb->callback([path, &session] {
    session.verb = "info";
    session.work = [path, &session] {
      Json const result = info(*path, session.context);
      session.report.update(result);
      print(result, "");
    };
  });
}

}  // namespace scanview
