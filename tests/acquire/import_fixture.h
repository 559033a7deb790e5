#pragma once
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>
#include <filesystem>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <string>

#include "acquire/scan_set.h"
#include "base/files.h"
#include "base/image_file.h"

namespace scanview {

inline std::filesystem::path real_data(std::string const& name) {
  return std::filesystem::path(SCANVIEW_SOURCE_DIR) / ".." / "shared" / "data" / name;
}

/// A camera of 64x48 pixels, 60 pixels of focal length.
inline Camera small_camera() { return Camera::perspective(64, 48, 60, 62, 31.5, 22.5); }

/// The intrinsics of small_camera as rgbd.json has them.
inline Json small_intrinsics() {
  Camera const camera = small_camera();
  return {{"width", camera.width()}, {"height", camera.height()}, {"fx", camera.fx()},
          {"fy", camera.fy()},       {"cx", camera.cx()},         {"cy", camera.cy()}};
}

/// 16-bit steps of 1 mm of z(x, y) in metres; 0 where z is 0.
inline cv::Mat1w depth_picture(cv::Size size, std::function<double(int, int)> const& z) {
  cv::Mat1w picture(size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) picture(y, x) = static_cast<std::uint16_t>(std::lround(1000 * z(x, y)));
  return picture;
}

inline cv::Mat3b color_picture(cv::Size size) {
  cv::Mat3b picture(size);
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x)
      picture(y, x) = cv::Vec3b(static_cast<std::uint8_t>(3 * x), static_cast<std::uint8_t>(5 * y), 90);
  return picture;
}

/// A tilted plane in front of small_camera, in metres.
inline double plane_depth(int x, int y) { return 1.0 + 0.004 * x - 0.003 * y; }

inline void write_picture(std::filesystem::path const& path, cv::Mat const& picture) {
  std::filesystem::create_directories(path.parent_path());
  write_file(path, encode_png(picture));
}

/// A folder with `views` frames color/N.png and depth/N.png of the tilted plane and its rgbd.json.
inline Json write_rgbd(std::filesystem::path const& folder, int views) {
  cv::Size const size(64, 48);
  for (int i = 0; i < views; ++i) {
    write_picture(folder / "color" / fmt::format("{}.png", i), color_picture(size));
    write_picture(folder / "depth" / fmt::format("{:04d}.png", i), depth_picture(size, plane_depth));
  }
  Json json{{"color", "color/{}.png"},
            {"depth", "depth/{:04d}.png"},
            {"first", 0},
            {"last", views - 1},
            {"intrinsics", small_intrinsics()}};
  write_json(folder / "rgbd.json", json);
  return json;
}

inline std::string pose_text(Eigen::Isometry3d const& pose) {
  std::string text;
  for (int row = 0; row < 4; ++row)
    text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g}\n", pose.matrix()(row, 0), pose.matrix()(row, 1),
                        pose.matrix()(row, 2), pose.matrix()(row, 3));
  return text;
}

inline Eigen::Isometry3d some_pose(double angle = 0.4) {
  return Eigen::Translation3d(0.3, -0.2, 0.7) * Eigen::AngleAxisd(angle, Eigen::Vector3d(1, 2, -1).normalized());
}

}  // namespace scanview
