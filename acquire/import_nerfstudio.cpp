#include <fmt/format.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "acquire/import_build.h"
#include "acquire/rgbd_manifest.h"
#include "base/error.h"
#include "base/image_file.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

[[noreturn]] void fail(fs::path const& path, std::string const& message) {
  throw Error(ErrorCode::bad_input, path, message);
}

/// A key of the frame, or else of the whole file.
Json const* lookup(Json const& frame, Json const& all, char const* key) {
  if (auto const found = frame.find(key); found != frame.end()) return &*found;
  if (auto const found = all.find(key); found != all.end()) return &*found;
  return nullptr;
}

std::optional<double> number(Json const& frame, Json const& all, char const* key, fs::path const& path) {
  Json const* const value = lookup(frame, all, key);
  if (value == nullptr) return std::nullopt;
  if (!value->is_number() || !std::isfinite(value->get<double>()))
    fail(path, fmt::format("'{}' is no finite number", key));
  return value->get<double>();
}

std::optional<fs::path> file(Json const& frame, char const* key, fs::path const& path) {
  auto const found = frame.find(key);
  if (found == frame.end()) return std::nullopt;
  if (!found->is_string()) fail(path, fmt::format("'{}' is no text", key));
  return path.parent_path() / found->get<std::string>();
}

/// Synthetic sets leave the picture's ending out.
fs::path existing(fs::path const& picture) {
  for (char const* ending : {"", ".png", ".jpg"})
    if (fs::path const candidate = picture.string() + ending; fs::is_regular_file(candidate)) return candidate;
  return picture;
}

/// Intrinsics of a frame: fl_x (or camera_angle_x), fl_y, cx, cy, k1 k2 p1 p2. Sizes w and h may be left out.
LensCamera intrinsics(Json const& frame, Json const& all, cv::Size picture, fs::path const& path) {
  if (Json const* const model = lookup(frame, all, "camera_model"); model != nullptr)
    if (!model->is_string() || (*model != "OPENCV" && *model != "PINHOLE" && *model != "SIMPLE_PINHOLE"))
      fail(path, "'camera_model' is none of OPENCV, PINHOLE, SIMPLE_PINHOLE");
  auto const get = [&](char const* key) { return number(frame, all, key, path); };
  double const width = get("w").value_or(picture.width), height = get("h").value_or(picture.height);
  if (width != picture.width || height != picture.height)
    fail(path, fmt::format("'w' x 'h' is {} x {}, the picture {} x {}", width, height, picture.width, picture.height));
  auto const focal = [&](char const* direct, char const* angle, double size) -> std::optional<double> {
    if (auto const value = get(direct)) return value;
    if (auto const value = get(angle)) return size / (2 * std::tan(*value / 2));
    return std::nullopt;
  };
  auto const fx = focal("fl_x", "camera_angle_x", width);
  if (!fx) fail(path, "intrinsics are missing: neither 'fl_x' nor 'camera_angle_x'");
  double const fy = focal("fl_y", "camera_angle_y", height).value_or(*fx);
  LensCamera result;
  // Their principal point counts from the picture's corner, ours from the centre of the first pixel.
  result.camera = Camera::perspective(picture.width, picture.height, *fx, fy, get("cx").value_or(width / 2) - 0.5,
                                      get("cy").value_or(height / 2) - 0.5);
  result.lens = {get("k1").value_or(0), get("k2").value_or(0), get("p1").value_or(0), get("p2").value_or(0),
                 get("k3").value_or(0)};
  if (get("k4").value_or(0) != 0) fail(path, "'k4' is not of the lens model that is known here (k1 k2 p1 p2 k3)");
  return result;
}

/// object_from_camera; theirs has y up and looks along -z.
Eigen::Isometry3d pose(Json const& frame, std::string const& name, fs::path const& path) {
  std::string const what = fmt::format("'transform_matrix' of frame {}", name);
  auto const found = frame.find("transform_matrix");
  if (found == frame.end()) fail(path, what + " is missing");
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  if (!found->is_array() || (found->size() != 4 && found->size() != 3)) fail(path, what + " is not 4 rows");
  for (std::size_t row = 0; row < found->size(); ++row) {
    Json const& numbers = (*found)[row];
    if (!numbers.is_array() || numbers.size() != 4) fail(path, what + " has a row that is not 4 numbers");
    for (std::size_t col = 0; col < 4; ++col) {
      if (!numbers[col].is_number()) fail(path, what + " has an entry that is no number");
      matrix(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(col)) = numbers[col].get<double>();
    }
  }
  Eigen::Isometry3d result = pose_from_matrix(matrix, path, what);
  result.linear() = result.linear() * Eigen::Vector3d(1, -1, -1).asDiagonal();
  return result;
}

/// The whole file, with an object for each frame.
Json read_transforms(fs::path const& path) {
  if (!fs::is_regular_file(path)) fail(path, "no such file");
  Json all = read_json(path);
  if (!all.is_object() || !all.contains("frames") || !all["frames"].is_array()) fail(path, "no list 'frames'");
  for (auto const& frame : all["frames"])
    if (!frame.is_object()) fail(path, "a frame is no object");
  return all;
}

Unit unit_of(Json const& all, fs::path const& path) {
  auto const found = all.find("unit");
  return found != all.end() && found->is_string() ? unit_from_string(found->get<std::string>(), path) : Unit::arbitrary;
}

/// The views' names, in the order of the frames.
std::vector<std::string> view_names(Json const& frames, fs::path const& path) {
  std::vector<std::string> names;
  for (auto const& frame : frames) {
    auto const color = file(frame, "file_path", path);
    if (!color) fail(path, "a frame without 'file_path'");
    names.push_back(color->stem().string());
  }
  return safe_view_names(names);
}

struct FrameFiles {
  std::string view;
  fs::path color, depth;
  std::optional<fs::path> mask;
};

RawView load(Json const& frame, Json const& all, FrameFiles const& files, double depth_unit, fs::path const& path) {
  RawView raw;
  raw.object_from_camera = pose(frame, files.view, path);
  cv::Mat3b const color = read_color(files.color);
  LensCamera const k = intrinsics(frame, all, color.size(), path);
  raw.camera = k.camera;
  raw.color = undistort_color(color, k.camera, k.lens);
  cv::Mat const stored = read_image(files.depth);
  if (stored.type() != CV_16UC1) fail(files.depth, "a depth picture has one channel of 16 bits");
  if (stored.size() != color.size())
    fail(files.depth, fmt::format("depth is {}x{}, colour {}x{}", stored.cols, stored.rows, color.cols, color.rows));
  cv::Mat1f depth(stored.size());
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      auto const value = stored.at<std::uint16_t>(y, x);
      depth(y, x) = value == 0 ? kMissing : static_cast<float>(value * depth_unit);
    }
  raw.depth = undistort_depth(depth, k.camera, k.lens);
  if (files.mask) {
    cv::Mat1b mask;
    cv::extractChannel(read_color(*files.mask), mask, 0);
    if (mask.size() != color.size()) fail(*files.mask, "the mask's size is not the picture's");
    // The lens moves the mask like a depth: nearest neighbour, nothing outside.
    cv::Mat1f moved;
    mask.convertTo(moved, CV_32F);
    moved = undistort_depth(moved, k.camera, k.lens);
    raw.mask = moved > 0;
  }
  return raw;
}

}  // namespace

ScanSet read_nerfstudio_poses(fs::path const& path) {
  Json const all = read_transforms(path);
  auto const names = view_names(all["frames"], path);
  ScanSet set;
  set.unit = unit_of(all, path);
  for (std::size_t i = 0; i < names.size(); ++i) {
    View view;
    view.name = names[i];
    view.object_from_camera = pose(all["frames"][i], names[i], path);
    set.views.push_back(std::move(view));
  }
  return set;
}

ImportResult import_nerfstudio(fs::path const& path, ImportOptions const& options, Context& context) {
  fs::path const manifest = fs::is_directory(path) ? path / "transforms.json" : path;
  Json const all = read_transforms(manifest);
  Json const nothing = Json::object();
  double const depth_unit = number(all, nothing, "depth_unit_scale_factor", manifest).value_or(0.001);
  if (!(depth_unit > 0)) fail(manifest, "'depth_unit_scale_factor' is not positive");

  BuildPlan plan;
  plan.path = manifest;
  plan.unit = unit_of(all, manifest);
  plan.noise = [&](double typical) { return sensor_noise(plan.unit, depth_unit, typical); };
  Json const& frames = all["frames"];
  auto const names = view_names(frames, manifest);
  std::vector<FrameFiles> files;
  for (std::size_t i = 0; i < names.size(); ++i) {
    fs::path const color = *file(frames[i], "file_path", manifest);
    auto const depth = file(frames[i], "depth_file_path", manifest);
    if (!depth)
      fail(manifest, fmt::format("frame {} has no 'depth_file_path': only frames with depth can be imported",
                                 color.filename().string()));
    files.push_back({names[i], existing(color), *depth, file(frames[i], "mask_path", manifest)});
  }
  for (std::size_t i = 0; i < files.size(); ++i)
    plan.views.push_back({names[i], [&, i] { return load(frames[i], all, files[i], depth_unit, manifest); }});
  ImportResult result = build_import(plan, options, context);
  result.files_read.push_back(manifest);
  for (std::size_t i = 0; i < files.size(); i += static_cast<std::size_t>(options.step)) {
    result.files_read.push_back(files[i].color);
    result.files_read.push_back(files[i].depth);
    if (files[i].mask) result.files_read.push_back(*files[i].mask);
  }
  std::erase_if(result.files_read, [](fs::path const& file) { return !fs::is_regular_file(file); });
  return result;
}

}  // namespace scanview
