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
Eigen::Isometry3d pose(Json const& frame, fs::path const& path) {
  auto const found = frame.find("transform_matrix");
  if (found == frame.end()) fail(path, "'transform_matrix' is missing");
  Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
  if (!found->is_array() || (found->size() != 4 && found->size() != 3)) fail(path, "'transform_matrix' is not 4 rows");
  for (std::size_t row = 0; row < found->size(); ++row) {
    Json const& numbers = (*found)[row];
    if (!numbers.is_array() || numbers.size() != 4) fail(path, "'transform_matrix' has a row that is not 4 numbers");
    for (std::size_t col = 0; col < 4; ++col) {
      if (!numbers[col].is_number()) fail(path, "'transform_matrix' has an entry that is no number");
      matrix(static_cast<Eigen::Index>(row), static_cast<Eigen::Index>(col)) = numbers[col].get<double>();
    }
  }
  Eigen::Isometry3d result = pose_from_matrix(matrix, path, "'transform_matrix'");
  result.linear() = result.linear() * Eigen::Vector3d(1, -1, -1).asDiagonal();
  return result;
}

struct FrameFiles {
  fs::path color, depth;
  std::optional<fs::path> mask;
};

RawView load(Json const& frame, Json const& all, FrameFiles const& files, double depth_unit, fs::path const& path) {
  RawView raw;
  raw.object_from_camera = pose(frame, path);
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

ImportResult import_nerfstudio(fs::path const& path, ImportOptions const& options, Context& context) {
  fs::path const manifest = fs::is_directory(path) ? path / "transforms.json" : path;
  if (!fs::is_regular_file(manifest)) fail(manifest, "no such file");
  Json const all = read_json(manifest);
  if (!all.is_object() || !all.contains("frames") || !all["frames"].is_array()) fail(manifest, "no list 'frames'");
  Json const nothing = Json::object();
  double const depth_unit = number(all, nothing, "depth_unit_scale_factor", manifest).value_or(0.001);
  if (!(depth_unit > 0)) fail(manifest, "'depth_unit_scale_factor' is not positive");

  BuildPlan plan;
  plan.path = manifest;
  plan.unit = Unit::arbitrary;
  if (auto const found = all.find("unit"); found != all.end() && found->is_string())
    plan.unit = unit_from_string(found->get<std::string>(), manifest);
  plan.noise = [&](double typical) { return sensor_noise(plan.unit, depth_unit, typical); };
  std::vector<FrameFiles> files;
  std::vector<std::string> names;
  for (auto const& frame : all["frames"]) {
    if (!frame.is_object()) fail(manifest, "a frame is no object");
    auto const color = file(frame, "file_path", manifest);
    auto const depth = file(frame, "depth_file_path", manifest);
    if (!color) fail(manifest, "a frame without 'file_path'");
    if (!depth)
      fail(manifest, fmt::format("frame {} has no 'depth_file_path': only frames with depth can be imported",
                                 color->filename().string()));
    files.push_back({existing(*color), *depth, file(frame, "mask_path", manifest)});
    names.push_back(color->stem().string());
  }
  names = safe_view_names(names);
  for (std::size_t i = 0; i < files.size(); ++i)
    plan.views.push_back({names[i], [&, &frame = all["frames"][i], &own = files[i]] {
                            return load(frame, all, own, depth_unit, manifest);
                          }});
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
