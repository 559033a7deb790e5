#include "acquire/rgbd_manifest.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <sstream>

#include "base/error.h"
#include "base/json_fields.h"

namespace scanview {
namespace {

constexpr int kMostFrames = 1'000'000;

[[noreturn]] void fail(std::filesystem::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

Eigen::Vector3d vector3(Json const& json, std::string const& key, std::filesystem::path const& path) {
  if (!json.is_array() || json.size() != 3) fail(path, fmt::format("'{}' is not three numbers", key));
  return {json_finite(json[0], key, path), json_finite(json[1], key, path), json_finite(json[2], key, path)};
}

/// The camera stood still and the object turned: p_camera_i = T_i p_camera_0, so object_from_camera_i = T_i^-1 in the
/// frame that the first view's camera sees.
std::vector<Eigen::Isometry3d> turntable_poses(Json const& json, std::size_t frames,
                                               std::filesystem::path const& path) {
  refuse_unknown_keys(json, {"axis_point", "axis", "angles_deg"}, "turntable", path);
  Eigen::Vector3d const point = vector3(json_member(json, "axis_point", path), "axis_point", path);
  Eigen::Vector3d const axis = vector3(json_member(json, "axis", path), "axis", path);
  if (!(axis.norm() > 1e-9)) fail(path, "'axis' of the turntable has no direction");
  Json const& angles = json_member(json, "angles_deg", path);
  if (!angles.is_array() || angles.size() != frames)
    fail(path, fmt::format("'angles_deg' has {} entries for {} views", angles.is_array() ? angles.size() : 0, frames));
  std::vector<Eigen::Isometry3d> poses;
  for (auto const& angle : angles) {
    double const radians = json_finite(angle, "angles_deg", path) * std::numbers::pi / 180;
    poses.push_back(Eigen::Translation3d(point) * Eigen::AngleAxisd(-radians, axis.normalized()) *
                    Eigen::Translation3d(-point));
  }
  return poses;
}

}  // namespace

std::string format_index(std::string const& pattern, int index, std::filesystem::path const& path) {
  auto const open = pattern.find('{');
  auto const close = pattern.find('}', open == std::string::npos ? 0 : open);
  if (open == std::string::npos || close == std::string::npos ||
      pattern.find_first_of("{}", close + 1) != std::string::npos)
    fail(path, fmt::format("'{}' must have one {{}} (or {{:06d}}) for the index", pattern));
  std::string const spec = pattern.substr(open + 1, close - open - 1);
  int width = 0;
  if (!spec.empty()) {
    std::size_t const digits = spec.size() >= 3 ? spec.size() - 3 : 0;  // ":0" ... "d"
    bool const good = spec.size() >= 4 && spec.size() <= 5 && spec.starts_with(":0") && spec.back() == 'd' &&
                      std::from_chars(spec.data() + 2, spec.data() + 2 + digits, width).ptr == spec.data() + 2 + digits;
    if (!good) fail(path, fmt::format("'{}': the index is written {{}} or {{:06d}}", pattern));
  }
  return pattern.substr(0, open) + fmt::format("{:0{}d}", index, width) + pattern.substr(close + 1);
}

Eigen::Isometry3d read_pose_text(std::filesystem::path const& path) {
  std::istringstream words(read_file(path));
  std::vector<double> values;
  std::string word;
  while (words >> word) {
    double value = 0;
    char const* const begin = word.data() + (word.front() == '+');
    auto const [end, problem] = std::from_chars(begin, word.data() + word.size(), value);
    // "nan" and "inf" parse; pose_from_matrix names them. Anything else that is no number is an error here.
    if (problem == std::errc::invalid_argument || end != word.data() + word.size())
      fail(path, fmt::format("'{}' is no number: a pose is 4 rows of 4 numbers", word.substr(0, 40)));
    values.push_back(value);
    if (values.size() > 16) break;
  }
  if (values.size() != 16 && values.size() != 12)
    fail(path, fmt::format("a pose is 4 rows of 4 numbers, here are {}{}", values.size() > 16 ? "more than " : "",
                           std::min<std::size_t>(values.size(), 16)));
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  for (std::size_t i = 0; i < values.size(); ++i)
    matrix(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) = values[i];
  return pose_from_matrix(matrix, path, "the pose");
}

RgbdSource read_rgbd_manifest(std::filesystem::path const& path) {
  Json const json = read_json(path);
  refuse_unknown_keys(json,
                      {"color", "depth", "first", "last", "step", "depth_unit", "unit", "missing", "depth_rotate_right",
                       "intrinsics", "depth_intrinsics", "color_from_depth", "poses", "turntable", "fixed_camera"},
                      "", path);
  RgbdSource source;
  source.files.push_back(path);
  std::string const color = json_text(json_member(json, "color", path), "color", path);
  std::string const depth = json_text(json_member(json, "depth", path), "depth", path);
  int const first = json_integer(json_member(json, "first", path), "first", 0, kMostFrames, path);
  int const last = json_integer(json_member(json, "last", path), "last", 0, kMostFrames, path);
  int const step = json.contains("step") ? json_integer(json["step"], "step", 1, kMostFrames, path) : 1;
  if (last < first) fail(path, fmt::format("'last' ({}) is less than 'first' ({})", last, first));

  if (json.contains("depth_unit")) source.depth_unit = json_finite(json["depth_unit"], "depth_unit", path);
  if (!(source.depth_unit > 0)) fail(path, "'depth_unit' is not positive");
  if (json.contains("unit")) source.unit = unit_from_string(json_text(json["unit"], "unit", path), path);
  if (json.contains("missing")) {
    source.missing.clear();
    if (!json["missing"].is_array()) fail(path, "'missing' is no list");
    for (auto const& value : json["missing"]) source.missing.push_back(json_integer(value, "missing", 0, 65535, path));
  }
  if (json.contains("depth_rotate_right"))
    source.depth_rotate_right = json_integer(json["depth_rotate_right"], "depth_rotate_right", 0, 15, path);
  source.color = lens_camera_from_json(json_member(json, "intrinsics", path), "intrinsics", path);
  if (json.contains("depth_intrinsics") != json.contains("color_from_depth"))
    fail(path, "'depth_intrinsics' and 'color_from_depth' belong together: one is missing");
  if (json.contains("depth_intrinsics")) {
    source.depth = lens_camera_from_json(json["depth_intrinsics"], "depth_intrinsics", path);
    source.color_from_depth = pose_from_json(json["color_from_depth"], path, "'color_from_depth'");
  }
  if (json.contains("fixed_camera")) {
    source.fixed_camera = json_boolean(json["fixed_camera"], "fixed_camera", path);
  }

  if (json.contains("poses") && json.contains("turntable")) fail(path, "'poses' and 'turntable' exclude each other");
  std::string const poses = json.contains("poses") ? json_text(json["poses"], "poses", path) : "none";
  auto const folder = path.parent_path();
  for (int index = first; index <= last; index += step) {
    RgbdFrame frame;
    frame.name = fmt::format("{:03d}", index);
    frame.color = folder / format_index(color, index, path);
    frame.depth = folder / format_index(depth, index, path);
    if (poses != "none") frame.pose_file = folder / format_index(poses, index, path);
    source.frames.push_back(std::move(frame));
  }
  if (json.contains("turntable")) {
    auto const places = turntable_poses(json["turntable"], source.frames.size(), path);
    for (std::size_t i = 0; i < places.size(); ++i) source.frames[i].pose = places[i];
  }
  return source;
}

}  // namespace scanview
