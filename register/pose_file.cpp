#include "register/pose_file.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <map>
#include <set>
#include <sstream>

#include "acquire/archive.h"
#include "acquire/import.h"
#include "acquire/rgbd_manifest.h"
#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/files.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

void take_poses_by_name(ScanSet const& other, fs::path const& path, ScanSet& set) {
  for (auto& view : set.views) {
    auto const it =
        std::find_if(other.views.begin(), other.views.end(), [&](View const& v) { return v.name == view.name; });
    if (it == other.views.end() || !it->object_from_camera)
      fail(path, fmt::format("has no pose of view {}", view.name));
    view.object_from_camera = it->object_from_camera;
  }
}

/// A .conf places scans; what frame a scan's camera has, the importer knows.
void read_conf(fs::path const& path, ScanSet& set) {
  Context context;
  take_poses_by_name(import_stanford(path, {}, context).set, path, set);
}

void read_aln(fs::path const& path, ScanSet& set) {
  std::istringstream text(read_file(path));
  std::size_t count = 0;
  if (!(text >> count)) fail(path, "is no MeshLab alignment (it does not start with the number of meshes)");
  std::map<std::string, Eigen::Isometry3d> poses;
  for (std::size_t i = 0; i < count; ++i) {
    std::string name, hash;
    Eigen::Matrix4d matrix;
    if (!(text >> name >> hash) || hash != "#")
      fail(path, fmt::format("ends, or has no '#', at mesh {} of {}", i + 1, count));
    for (int k = 0; k < 16; ++k)
      if (!(text >> matrix(k / 4, k % 4))) fail(path, fmt::format("has no 16 numbers for {}", name));
    poses[fs::path(name).stem().string()] = pose_from_matrix(matrix, path, "pose of " + name);
  }
  for (auto& view : set.views) {
    auto const it = poses.find(view.name);
    if (it == poses.end()) fail(path, fmt::format("has no pose of view {}", view.name));
    view.object_from_camera = it->second;
  }
}

void read_tum(fs::path const& path, ScanSet& set) {
  std::istringstream text(read_file(path));
  std::size_t next = 0;
  for (std::string line; std::getline(text, line);) {
    line = line.substr(0, line.find('#'));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    double stamp = 0, x = 0, y = 0, z = 0, qx = 0, qy = 0, qz = 0, qw = 0;
    std::istringstream numbers(line);
    if (!(numbers >> stamp >> x >> y >> z >> qx >> qy >> qz >> qw))
      fail(path, fmt::format("line '{}' is not 'stamp tx ty tz qx qy qz qw'", line));
    if (next == set.views.size()) fail(path, fmt::format("has more poses than the set's {} views", set.views.size()));
    Eigen::Quaterniond const q(qw, qx, qy, qz);
    Eigen::Vector3d const t(x, y, z);
    if (!t.allFinite() || !(std::abs(q.norm() - 1) < 1e-2)) fail(path, fmt::format("pose {} is no rigid motion", next));
    set.views[next++].object_from_camera = Eigen::Isometry3d(Eigen::Translation3d(t) * q.normalized());
  }
  if (next != set.views.size()) fail(path, fmt::format("has {} poses for {} views", next, set.views.size()));
}

void read_rgbd(fs::path const& path, ScanSet& set) {
  RgbdSource const source = read_rgbd_manifest(path);
  if (source.frames.size() != set.views.size())
    fail(path, fmt::format("has {} frames for {} views", source.frames.size(), set.views.size()));
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    auto const& frame = source.frames[i];
    if (frame.pose)
      set.views[i].object_from_camera = *frame.pose;
    else if (frame.pose_file)
      set.views[i].object_from_camera = read_pose_text(*frame.pose_file);
    else
      fail(path, "says no poses");
  }
}

using Marks = std::map<std::string, Eigen::Vector3d>;  // point name -> place

/// The marked points of one view, in its camera's coordinates.
Marks lift_marks(View const& view, Json const& marks, fs::path const& path) {
  Marks lifted;
  for (auto const& [name, pixel] : marks.items()) {
    std::string const where = fmt::format("mark {} of view {}", name, view.name);
    if (!pixel.is_array() || pixel.size() != 2 || !pixel[0].is_number() || !pixel[1].is_number())
      fail(path, where + " is not [u, v]");
    double const u = pixel[0].get<double>(), v = pixel[1].get<double>();
    if (!view.image.camera.contains({u, v})) fail(path, where + " lies outside the picture");
    int const x = static_cast<int>(std::lround(u)), y = static_cast<int>(std::lround(v));
    if (!view.image.has_depth(x, y)) fail(path, where + " has no depth");
    lifted[name] = view.image.camera.unproject(u, v, view.image.depth(y, x));
  }
  return lifted;
}

/// The rigid motion that carries `from` nearest to `to` (Umeyama 1991 without scale), over the points both name.
Eigen::Isometry3d fit(Marks const& from, Marks const& to, std::string const& view, fs::path const& path) {
  std::vector<std::string> common;
  for (auto const& [name, p] : from)
    if (to.contains(name)) common.push_back(name);
  if (common.size() < 3)
    fail(path, fmt::format("view {} shares fewer than three marks with the views before it", view));
  Eigen::Matrix3Xd source(3, common.size()), target(3, common.size());
  for (std::size_t i = 0; i < common.size(); ++i) {
    source.col(static_cast<Eigen::Index>(i)) = from.at(common[i]);
    target.col(static_cast<Eigen::Index>(i)) = to.at(common[i]);
  }
  Eigen::JacobiSVD<Eigen::MatrixXd> const spread(source.colwise() - source.rowwise().mean());
  if (!(spread.singularValues()(1) > 1e-3 * spread.singularValues()(0)))
    fail(path, fmt::format("the marks of view {} lie on one line", view));
  return Eigen::Isometry3d(Eigen::umeyama(source, target, false));
}

void read_marks(fs::path const& path, Json const& marks, ScanSet& set) {
  std::map<std::string, Marks> lifted;
  for (auto const& view : set.views) {
    if (!marks.contains(view.name) || !marks[view.name].is_object())
      fail(path, fmt::format("has no marks of view {}", view.name));
    lifted[view.name] = lift_marks(view, marks[view.name], path);
  }
  Marks placed;  // object coordinates: the first view's camera
  std::set<std::string> open;
  for (auto& view : set.views) {
    view.object_from_camera.reset();
    open.insert(view.name);
  }
  // Next comes the view that shares most marks with those placed, so that a chain of views is enough.
  while (!open.empty()) {
    View* best = nullptr;
    std::size_t best_common = 0;
    for (auto& view : set.views) {
      if (!open.contains(view.name)) continue;
      std::size_t common = placed.empty() ? 1 : 0;
      for (auto const& [name, p] : lifted[view.name]) common += placed.contains(name);
      if (!best || common > best_common) best = &view, best_common = common;
      if (placed.empty()) break;
    }
    best->object_from_camera =
        placed.empty() ? Eigen::Isometry3d::Identity() : fit(lifted[best->name], placed, best->name, path);
    for (auto const& [name, p] : lifted[best->name]) placed.try_emplace(name, *best->object_from_camera * p);
    open.erase(best->name);
  }
}

}  // namespace

void read_poses(fs::path const& path, ScanSet& set) {
  std::string const ending = path.extension().string();
  if (ending == ".conf" || is_archive(path)) return read_conf(path, set);
  if (ending == ".aln") return read_aln(path, set);
  if (ending != ".json") return read_tum(path, set);
  Json const json = read_json(path);
  if (json.is_object() && json.contains("marks")) return read_marks(path, json["marks"], set);
  if (json.is_object() && json.contains("format"))
    return take_poses_by_name(read_manifest(path.parent_path()), path, set);
  read_rgbd(path, set);
}

}  // namespace scanview
