#include "register/pose_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "acquire/archive.h"
#include "acquire/export.h"
#include "acquire/import.h"
#include "acquire/import_build.h"
#include "acquire/rgbd_manifest.h"
#include "acquire/scan_set_file.h"
#include "acquire/stanford_conf.h"
#include "acquire/text_table.h"
#include "acquire/trajectory.h"
#include "base/error.h"
#include "base/files.h"
#include "register/marks.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

constexpr char const* kOwnMesh = "mesh.ply";  // in view_folder(NAME)

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

/// What a length in `from` is multiplied by to be one in `to`.
double conversion(Unit from, Unit to) {
  if (from == to || from == Unit::arbitrary || to == Unit::arbitrary) return 1;
  return to == Unit::mm ? 1000 : 0.001;
}

void take(View& view, Eigen::Isometry3d pose, Unit from, Unit to) {
  pose.translation() *= conversion(from, to);
  view.object_from_camera = pose;
}

void take_by_name(ScanSet const& other, fs::path const& path, ScanSet& set) {
  for (auto& view : set.views) {
    auto const named = [&](View const& v) { return v.name == view.name; };
    auto const it = std::find_if(other.views.begin(), other.views.end(), named);
    if (it == other.views.end() || !it->object_from_camera)
      fail(path, fmt::format("has no pose of view {}", view.name));
    if (std::any_of(it + 1, other.views.end(), named)) fail(path, fmt::format("has two poses of view {}", view.name));
    take(view, *it->object_from_camera, other.unit, set.unit);
  }
}

void require_count(std::size_t poses, ScanSet const& set, fs::path const& path) {
  if (poses < set.views.size())
    fail(path,
         fmt::format("has {} poses for {} views: none of view {}", poses, set.views.size(), set.views[poses].name));
  if (poses > set.views.size()) fail(path, fmt::format("has {} poses for {} views", poses, set.views.size()));
}

bool is_own_mesh(fs::path const& file) { return file.filename() == kOwnMesh && file.has_parent_path(); }

std::string view_of(fs::path const& file) {
  return safe_view_name((is_own_mesh(file) ? file.parent_path().filename() : file.stem()).string());
}

ScanSet named_poses() {
  ScanSet set;
  set.unit = Unit::arbitrary;
  return set;
}

void add_pose(ScanSet& poses, std::string name, Eigen::Isometry3d const& pose) {
  poses.views.emplace_back().name = std::move(name);
  poses.views.back().object_from_camera = pose;
}

/// A .conf places files. Which frame the camera of a range scan has, the importer knows; the set's own meshes are in
/// camera coordinates.
ScanSet read_conf(fs::path const& path) {
  if (!is_archive(path)) {
    auto const lines = parse_conf(read_file(path), path);
    if (std::all_of(lines.begin(), lines.end(), [](ConfLine const& line) { return is_own_mesh(line.file); })) {
      ScanSet poses = named_poses();
      for (auto const& line : lines) add_pose(poses, view_of(line.file), world_from_scan(line, path));
      return poses;
    }
  }
  Context context;
  return import_stanford(path, {}, context).set;
}

ScanSet read_aln(fs::path const& path) {
  std::istringstream text(read_file(path));
  std::size_t count = 0;
  if (!(text >> count)) fail(path, "is no MeshLab alignment (it does not start with the number of meshes)");
  ScanSet poses = named_poses();
  for (std::size_t i = 0; i < count; ++i) {
    std::string name, hash;
    Eigen::Matrix4d matrix;
    if (!std::getline(text >> std::ws, name) || !(text >> hash) || hash != "#")
      fail(path, fmt::format("ends, or has no '#', at mesh {} of {}", i + 1, count));
    name.erase(name.find_last_not_of(" \t\r") + 1);
    for (int k = 0; k < 16; ++k)
      if (!(text >> matrix(k / 4, k % 4))) fail(path, fmt::format("has no 16 numbers for {}", name));
    add_pose(poses, view_of(name), pose_from_matrix(matrix, path, "the pose of " + name));
  }
  return poses;
}

void read_trajectory(fs::path const& path, ScanSet& set) {
  auto const table = read_text_table(path);
  bool const redwood = !table.empty() && table.front().words.size() == 3;
  auto const poses = redwood ? read_redwood_trajectory(path) : read_tum_trajectory(path);
  require_count(poses.size(), set, path);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    if (!poses[i].problem.empty()) fail(path, fmt::format("view {}: {}", set.views[i].name, poses[i].problem));
    set.views[i].object_from_camera = poses[i].world_from_camera;
  }
}

void read_rgbd(fs::path const& path, ScanSet& set) {
  RgbdSource const source = read_rgbd_manifest(path);
  require_count(source.frames.size(), set, path);
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    auto const& frame = source.frames[i];
    if (!frame.pose && !frame.pose_file) fail(path, "says no poses");
    take(set.views[i], frame.pose ? *frame.pose : read_pose_text(*frame.pose_file), source.unit, set.unit);
  }
}

std::string number_row(std::initializer_list<double> numbers) {
  std::string row;
  for (double const number : numbers) row += fmt::format("{}{:.17g}", row.empty() ? "" : " ", number);
  return row + "\n";
}

std::string matrix_rows(Eigen::Isometry3d const& pose) {
  std::string rows;
  for (int r = 0; r < 4; ++r) {
    Eigen::RowVector4d const row = pose.matrix().row(r);
    rows += number_row({row[0], row[1], row[2], row[3]});
  }
  return rows;
}

std::string own_mesh(View const& view, fs::path const& folder, fs::path const& file) {
  return (fs::absolute(folder) / view_folder(view.name) / kOwnMesh)
      .lexically_normal()
      .lexically_proximate(fs::absolute(file).lexically_normal().parent_path())
      .generic_string();
}

std::string format_conf(ScanSet const& set, fs::path const& folder, fs::path const& path) {
  std::string text;
  for (View const& view : set.views) {
    std::string const mesh = own_mesh(view, folder, path);
    if (mesh.find_first_of(" \t") != std::string::npos)
      fail(path, fmt::format("a .conf cannot name '{}', which has a space: write it into the set's folder", mesh));
    text += format_conf_line(mesh, *view.object_from_camera);
  }
  return text;
}

std::string format_aln(ScanSet const& set, fs::path const& folder, fs::path const& path) {
  std::string text = fmt::format("{}\n", set.views.size());
  for (View const& view : set.views)
    text += own_mesh(view, folder, path) + "\n#\n" + matrix_rows(*view.object_from_camera);
  return text + "0\n";
}

std::string format_tum(ScanSet const& set) {
  std::string text = fmt::format("# time (the view's number) tx ty tz qx qy qz qw, unit {}\n", to_string(set.unit));
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    Eigen::Vector3d const t = set.views[i].object_from_camera->translation();
    Eigen::Quaterniond const q = Eigen::Quaterniond(set.views[i].object_from_camera->linear()).normalized();
    text += number_row({static_cast<double>(i), t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()});
  }
  return text;
}

std::string format_redwood(ScanSet const& set) {
  std::string text;
  for (std::size_t i = 0; i < set.views.size(); ++i)
    text += fmt::format("{} {} {}\n", i, i, i + 1) + matrix_rows(*set.views[i].object_from_camera);
  return text;
}

}  // namespace

fs::path find_pose_file(fs::path const& path) {
  if (!fs::is_directory(path)) return path;
  for (char const* name : {"scanset.json", "transforms.json", "rgbd.json"})
    if (fs::exists(path / name)) return path / name;
  fs::path const images = find_colmap_images(path);
  if (images.empty()) fail(path, "is a folder without scanset.json, transforms.json, rgbd.json or COLMAP's images.txt");
  return images;
}

void read_poses(fs::path const& given, ScanSet& set) {
  fs::path const path = find_pose_file(given);
  std::string const ending = path.extension().string();
  if (ending == ".conf" || is_archive(path)) return take_by_name(read_conf(path), path, set);
  if (ending == ".aln") return take_by_name(read_aln(path), path, set);
  if (path.filename() == "images.txt") return take_by_name(read_colmap_poses(path), path, set);
  if (ending != ".json") return read_trajectory(path, set);
  Json const json = read_json(path);
  auto const has = [&](char const* key) { return json.is_object() && json.contains(key); };
  if (has("marks")) return place_by_marks(path, json["marks"], set);
  if (has("format")) return take_by_name(read_manifest(path), path, set);
  if (has("frames")) return take_by_name(read_nerfstudio_poses(path), path, set);
  read_rgbd(path, set);
}

void write_poses(fs::path const& path, PoseFormat format, ScanSet const& set, fs::path const& folder) {
  require_poses(path, set);
  switch (format) {
    case PoseFormat::conf:
      return write_file(path, format_conf(set, folder, path));
    case PoseFormat::aln:
      return write_file(path, format_aln(set, folder, path));
    case PoseFormat::tum:
      return write_file(path, format_tum(set));
    case PoseFormat::redwood:
      return write_file(path, format_redwood(set));
  }
}

}  // namespace scanview
