#include "calib/stereo_rig.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <opencv2/core.hpp>
#include <vector>

#include "base/error.h"
#include "base/json_fields.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;

std::vector<double> numbers(cv::FileStorage const& file, char const* key, fs::path const& path) {
  cv::FileNode const node = file[key];
  if (node.empty()) throw Error(ErrorCode::bad_input, path, fmt::format("has no '{}': not a stereo calibration", key));
  cv::Mat matrix;
  node >> matrix;
  if (matrix.empty() || matrix.channels() != 1)
    throw Error(ErrorCode::bad_input, path, fmt::format("'{}' is no matrix", key));
  matrix.convertTo(matrix, CV_64F);
  std::vector<double> values(matrix.begin<double>(), matrix.end<double>());
  for (double const value : values)
    if (!std::isfinite(value)) throw Error(ErrorCode::bad_input, path, fmt::format("'{}' is not finite", key));
  return values;
}

std::vector<double> numbers(cv::FileStorage const& file, char const* key, std::size_t count, fs::path const& path) {
  auto values = numbers(file, key, path);
  if (values.size() != count)
    throw Error(ErrorCode::bad_input, path, fmt::format("'{}' has {} numbers, not {}", key, values.size(), count));
  return values;
}

/// OpenCV writes 12 or 14 terms for thin prisms and tilted sensors: those we do not model must be 0.
Lens read_lens(cv::FileStorage const& file, char const* key, fs::path const& path) {
  auto values = numbers(file, key, path);
  while (values.size() > 8 && values.back() == 0) values.pop_back();
  if (values.size() > 8)
    throw Error(ErrorCode::bad_input, path,
                fmt::format("'{}' has thin prism or tilt terms, which are not supported (calibrate without)", key));
  if (values.size() > 5) values.resize(8);
  return Lens::from_values(values, path);
}

LensCamera read_camera(cv::FileStorage const& file, char const* matrix_key, char const* lens_key, cv::Size size,
                       fs::path const& path) {
  auto const m = numbers(file, matrix_key, 9, path);
  if (!(m[0] > 0) || !(m[4] > 0) || m[1] != 0 || m[3] != 0 || m[6] != 0 || m[7] != 0 || m[8] != 1)
    throw Error(ErrorCode::bad_input, path,
                fmt::format("'{}' is no camera matrix (skew is not supported)", matrix_key));
  LensCamera result;
  result.camera = Camera::perspective(size.width, size.height, m[0], m[4], m[2], m[5]);
  result.lens = read_lens(file, lens_key, path);
  return result;
}

cv::Size read_size(cv::FileStorage const& file, std::string const& prefix, cv::Size otherwise, fs::path const& path) {
  cv::FileNode const width = file[prefix + "image_width"], height = file[prefix + "image_height"];
  if (!width.isInt() || !height.isInt()) return otherwise;
  cv::Size const size(static_cast<int>(width), static_cast<int>(height));
  if (size.width < 1 || size.height < 1) throw Error(ErrorCode::bad_input, path, "the image size is not positive");
  return size;
}

cv::Mat to_mat(std::vector<double> const& values, int rows) { return cv::Mat(values, true).reshape(1, rows); }

cv::Mat camera_matrix(Camera const& c) { return to_mat({c.fx(), 0, c.cx(), 0, c.fy(), c.cy(), 0, 0, 1}, 3); }

cv::Mat lens_row(Lens const& l) {
  std::vector<double> values = {l.k1, l.k2, l.p1, l.p2, l.k3};
  if (l.k4 != 0 || l.k5 != 0 || l.k6 != 0) values.insert(values.end(), {l.k4, l.k5, l.k6});
  return to_mat(values, 1);
}

}  // namespace

Eigen::Vector2d LensCamera::project(Eigen::Vector3d const& p) const {
  if (!(p.z() > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  Eigen::Vector2d const seen = lens.distort(p.head<2>() / p.z());
  return {camera.fx() * seen.x() + camera.cx(), camera.fy() * seen.y() + camera.cy()};
}

Eigen::Vector3d LensCamera::ray(Eigen::Vector2d const& pixel) const {
  return lens.undistort(camera.ray_direction(pixel.x(), pixel.y()).head<2>()).homogeneous();
}

LensCamera lens_camera_from_json(Json const& json, std::string const& key, fs::path const& path) {
  refuse_unknown_keys(json, {"width", "height", "fx", "fy", "cx", "cy", "distortion"}, key, path);
  LensCamera result;
  Json camera = json;
  if (auto const found = json.find("distortion"); found != json.end()) {
    if (!found->is_null()) result.lens = Lens::from_json(*found, path);
    camera.erase("distortion");
  }
  camera["model"] = "perspective";
  result.camera = Camera::from_json(camera, path);
  return result;
}

StereoRig read_stereo_rig(fs::path const& path, cv::Size fallback_size) {
  std::string const text = read_file(path);
  StereoRig rig;
  try {
    cv::FileStorage const file(text, cv::FileStorage::READ | cv::FileStorage::MEMORY);
    if (!file.isOpened()) throw Error(ErrorCode::bad_input, path, "is no OpenCV YAML");
    cv::Size const left_size = read_size(file, "", fallback_size, path);
    if (left_size.empty())
      throw Error(ErrorCode::bad_input, path,
                  "has no 'image_width' and 'image_height', and there is no picture to ask");
    rig.left = read_camera(file, "M1", "D1", left_size, path);
    rig.right = read_camera(file, "M2", "D2", read_size(file, "right_", left_size, path), path);
    auto const r = numbers(file, "R", 9, path), t = numbers(file, "T", 3, path);
    Eigen::Matrix4d pose = Eigen::Matrix4d::Identity();
    for (int i = 0; i < 3; ++i) {
      for (int j = 0; j < 3; ++j) pose(i, j) = r[static_cast<std::size_t>(3 * i + j)];
      pose(i, 3) = t[static_cast<std::size_t>(i)];
    }
    rig.right_from_left = pose_from_matrix(pose, path, "R, T");
    if (!(rig.baseline() > 0)) throw Error(ErrorCode::bad_input, path, "'T' is zero: both cameras at one place");
    if (file["unit"].isString()) rig.unit = static_cast<std::string>(file["unit"]);
    if (rig.unit != "mm" && rig.unit != "m" && rig.unit != "arbitrary")
      throw Error(ErrorCode::bad_input, path, fmt::format("unit '{}' is none of mm, m, arbitrary", rig.unit));
    cv::FileNode const deviations = file["standard_deviations"];
    for (auto it = deviations.begin(); it != deviations.end(); ++it) {
      if ((*it).isMap() || !(*it).isNamed()) continue;
      // OpenCV's storage takes no '.' in a key.
      std::string name = (*it).name();
      if (auto const at = name.find("__"); at != std::string::npos) name.replace(at, 2, 1, '.');
      rig.standard_deviations[name] = static_cast<double>(*it);
    }
  } catch (cv::Exception const&) {
    throw Error(ErrorCode::bad_input, path, "is no OpenCV YAML, or is damaged");
  }
  return rig;
}

void write_stereo_rig(fs::path const& path, StereoRig const& rig) {
  cv::FileStorage file(".yml", cv::FileStorage::WRITE | cv::FileStorage::MEMORY);
  Camera const &left = rig.left.camera, &right = rig.right.camera;
  file << "image_width" << left.width() << "image_height" << left.height();
  if (left.width() != right.width() || left.height() != right.height())
    file << "right_image_width" << right.width() << "right_image_height" << right.height();
  file << "unit" << rig.unit;
  file << "M1" << camera_matrix(left) << "D1" << lens_row(rig.left.lens);
  file << "M2" << camera_matrix(right) << "D2" << lens_row(rig.right.lens);
  Eigen::Matrix3d const r = rig.right_from_left.linear();
  Eigen::Vector3d const t = rig.right_from_left.translation();
  file << "R" << to_mat({r(0, 0), r(0, 1), r(0, 2), r(1, 0), r(1, 1), r(1, 2), r(2, 0), r(2, 1), r(2, 2)}, 3);
  file << "T" << to_mat({t.x(), t.y(), t.z()}, 3);
  if (!rig.standard_deviations.empty()) {
    file << "standard_deviations"
         << "{";
    for (auto const& [dotted, value] : rig.standard_deviations) {
      std::string name = dotted;
      if (auto const at = name.find('.'); at != std::string::npos) name.replace(at, 1, 2, '_');
      file << name << value;
    }
    file << "}";
  }
  write_file(path, file.releaseAndGetString());
}

}  // namespace scanview
