#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "acquire/depth_resample.h"
#include "acquire/import_build.h"
#include "acquire/rgbd_layout.h"
#include "acquire/rgbd_manifest.h"
#include "base/error.h"
#include "base/image_file.h"

namespace scanview {
namespace {

void check_size(cv::Mat const& image, Camera const& camera, std::filesystem::path const& path) {
  if (image.cols != camera.width() || image.rows != camera.height())
    throw Error(ErrorCode::bad_input, path,
                fmt::format("the picture is {}x{}, its intrinsics are for {}x{}", image.cols, image.rows,
                            camera.width(), camera.height()));
}

cv::Mat1f read_depth(std::filesystem::path const& path, RgbdSource const& source) {
  cv::Mat const stored = read_image(path);
  if (stored.type() != CV_16UC1) throw Error(ErrorCode::bad_input, path, "a depth picture has one channel of 16 bits");
  std::array<bool, 65536> missing{};
  for (int const value : source.missing) missing[static_cast<std::size_t>(value)] = true;
  cv::Mat1f depth(stored.size());
  int const right = source.depth_rotate_right;
  for (int y = 0; y < depth.rows; ++y)
    for (int x = 0; x < depth.cols; ++x) {
      unsigned const raw = stored.at<std::uint16_t>(y, x);
      unsigned const value = ((raw >> right) | (raw << (16 - right))) & 0xffffu;
      depth(y, x) = missing[value] ? kMissing : static_cast<float>(value * source.depth_unit);
    }
  return depth;
}

RawView load(RgbdFrame const& frame, RgbdSource const& source, DepthNoise const& noise) {
  if (!frame.problem.empty()) throw Error(ErrorCode::bad_input, {}, frame.problem);
  RawView raw;
  raw.camera = source.color.camera;
  raw.object_from_camera = frame.pose;
  if (frame.pose_file) raw.object_from_camera = read_pose_text(*frame.pose_file);
  cv::Mat3b const color = read_color(frame.color);
  check_size(color, raw.camera, frame.color);
  raw.color = undistort_color(color, raw.camera, source.color.lens);
  cv::Mat1f const depth = read_depth(frame.depth, source);
  if (source.depth) {
    Camera const& own = source.depth->camera;
    check_size(depth, own, frame.depth);
    raw.depth = reproject_depth(undistort_depth(depth, own, source.depth->lens), own, raw.camera,
                                source.color_from_depth, noise);
  } else {
    check_size(depth, raw.camera, frame.depth);
    raw.depth = undistort_depth(depth, raw.camera, source.color.lens).clone();
    close_seams(raw.depth, raw.camera, noise);
  }
  return raw;
}

RgbdSource find_source(std::filesystem::path const& path) {
  namespace fs = std::filesystem;
  if (fs::is_regular_file(path)) return read_rgbd_manifest(path);
  if (!fs::is_directory(path)) throw Error(ErrorCode::bad_input, path, "no such folder or rgbd.json");
  if (fs::exists(path / "rgbd.json")) return read_rgbd_manifest(path / "rgbd.json");
  if (auto const source = read_rgbd_layout(path)) return *source;
  throw Error(ErrorCode::bad_input, path,
              fs::is_empty(path) ? "the folder is empty"
                                 : "neither rgbd.json nor a known layout (7-Scenes, TUM, Redwood/Open3D)");
}

}  // namespace

ImportResult import_rgbd(std::filesystem::path const& path, ImportOptions const& options, Context& context) {
  RgbdSource const source = find_source(path);
  for (auto const& warning : source.warnings) context.warn(warning);
  BuildPlan plan;
  plan.path = path;
  plan.unit = source.unit;
  plan.fixed_camera = source.fixed_camera;
  plan.noise = [&](double typical) { return sensor_noise(source.unit, source.depth_unit, typical); };
  // Where scale is arbitrary the depth of a thousand steps stands for the set until its median is known.
  DepthNoise const first_guess = sensor_noise(source.unit, source.depth_unit, 1000 * source.depth_unit);
  for (auto const& frame : source.frames)
    plan.views.push_back({frame.name, [&source, &frame, &first_guess] { return load(frame, source, first_guess); }});
  ImportResult result = build_import(plan, options, context);
  result.files_read = source.files;
  for (std::size_t i = 0; i < source.frames.size(); i += static_cast<std::size_t>(options.step)) {
    auto const& frame = source.frames[i];
    result.files_read.push_back(frame.color);
    result.files_read.push_back(frame.depth);
    if (frame.pose_file) result.files_read.push_back(*frame.pose_file);
  }
  std::erase_if(result.files_read, [](auto const& file) { return !std::filesystem::is_regular_file(file); });
  return result;
}

}  // namespace scanview
