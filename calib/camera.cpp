#include "calib/camera.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <cmath>
#include <limits>
#include <set>

#include "base/error.h"

namespace scanview {
namespace {

/// Larger pictures do not fit 32-bit pixel indices everywhere downstream.
constexpr int kMaxSize = 1 << 15;

double number(Json const& json, char const* key, std::filesystem::path const& path) {
  auto const it = json.find(key);
  if (it == json.end() || !it->is_number())
    throw Error(ErrorCode::bad_input, path, fmt::format("camera has no number '{}'", key));
  return it->get<double>();
}

int integer(Json const& json, char const* key, std::filesystem::path const& path) {
  double const value = number(json, key, path);
  if (value != std::floor(value) || std::abs(value) > kMaxSize)
    throw Error(ErrorCode::bad_input, path, fmt::format("camera '{}' is out of range", key));
  return static_cast<int>(value);
}

}  // namespace

Camera Camera::perspective(int width, int height, double fx, double fy, double cx, double cy) {
  Camera camera;
  camera.model_ = Model::perspective;
  camera.width_ = width, camera.height_ = height;
  camera.fx_ = fx, camera.fy_ = fy, camera.cx_ = cx, camera.cy_ = cy;
  camera.validate();
  return camera;
}

Camera Camera::orthographic(int width, int height, double spacing_x, double spacing_y, double cx, double cy) {
  Camera camera = perspective(width, height, 1.0 / spacing_x, 1.0 / spacing_y, cx, cy);
  camera.model_ = Model::orthographic;
  camera.spacing_x_ = spacing_x, camera.spacing_y_ = spacing_y;
  return camera;
}

void Camera::validate() const {
  auto const fail = [](std::string const& what) { throw Error(ErrorCode::bad_input, {}, "camera: " + what); };
  if (width_ < 1 || height_ < 1 || width_ > kMaxSize || height_ > kMaxSize)
    fail(fmt::format("size {}x{} is not within 1 .. {}", width_, height_, kMaxSize));
  if (!(fx_ > 0) || !(fy_ > 0) || !std::isfinite(fx_) || !std::isfinite(fy_))
    fail("focal length or spacing must be positive");
  if (!std::isfinite(cx_) || !std::isfinite(cy_)) fail("principal point must be finite");
}

Eigen::Vector2d Camera::project(Eigen::Vector3d const& p) const {
  if (!is_perspective()) return {fx_ * p.x() + cx_, fy_ * p.y() + cy_};
  if (!(p.z() > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return {fx_ * p.x() / p.z() + cx_, fy_ * p.y() / p.z() + cy_};
}

Eigen::Vector3d Camera::unproject(double u, double v, double z) const {
  double const x = (u - cx_) / fx_, y = (v - cy_) / fy_;
  return is_perspective() ? Eigen::Vector3d(x * z, y * z, z) : Eigen::Vector3d(x, y, z);
}

Eigen::Vector3d Camera::ray_origin(double u, double v) const {
  return is_perspective() ? Eigen::Vector3d(Eigen::Vector3d::Zero()) : unproject(u, v, 0);
}

Eigen::Vector3d Camera::ray_direction(double u, double v) const {
  return is_perspective() ? unproject(u, v, 1) : Eigen::Vector3d(Eigen::Vector3d::UnitZ());
}

bool Camera::contains(Eigen::Vector2d const& pixel) const {
  return pixel.x() >= -0.5 && pixel.y() >= -0.5 && pixel.x() < width_ - 0.5 && pixel.y() < height_ - 0.5;
}

Camera Camera::resized(int width, int height) const {
  Camera camera = *this;
  double const sx = static_cast<double>(width) / width_, sy = static_cast<double>(height) / height_;
  camera.width_ = width, camera.height_ = height;
  camera.fx_ *= sx, camera.fy_ *= sy;
  camera.spacing_x_ /= sx, camera.spacing_y_ /= sy;
  camera.cx_ = (cx_ + 0.5) * sx - 0.5, camera.cy_ = (cy_ + 0.5) * sy - 0.5;
  camera.validate();
  return camera;
}

Camera Camera::cropped(int x, int y, int width, int height) const {
  Camera camera = *this;
  camera.width_ = width, camera.height_ = height;
  camera.cx_ -= x, camera.cy_ -= y;
  camera.validate();
  return camera;
}

Json Camera::to_json() const {
  if (is_perspective())
    return {{"model", "perspective"},
            {"width", width_},
            {"height", height_},
            {"fx", fx_},
            {"fy", fy_},
            {"cx", cx_},
            {"cy", cy_}};
  return {{"model", "orthographic"}, {"width", width_}, {"height", height_}, {"spacing_x", spacing_x_},
          {"spacing_y", spacing_y_}, {"cx", cx_},       {"cy", cy_}};
}

Camera Camera::from_json(Json const& json, std::filesystem::path const& path) {
  if (!json.is_object()) throw Error(ErrorCode::bad_input, path, "camera is not an object");
  std::string const model = json.contains("model") && json["model"].is_string() ? json["model"].get<std::string>() : "";
  bool const is_perspective = model == "perspective";
  if (!is_perspective && model != "orthographic")
    throw Error(ErrorCode::bad_input, path, "camera 'model' is neither perspective nor orthographic");
  std::set<std::string> known = {"model", "width", "height", "cx", "cy"};
  known.insert(is_perspective ? "fx" : "spacing_x");
  known.insert(is_perspective ? "fy" : "spacing_y");
  for (auto const& [key, value] : json.items())
    if (!known.contains(key))
      throw Error(ErrorCode::bad_input, path, fmt::format("camera has an unknown key '{}'", key));
  int const width = integer(json, "width", path), height = integer(json, "height", path);
  double const cx = number(json, "cx", path), cy = number(json, "cy", path);
  try {
    return is_perspective
               ? perspective(width, height, number(json, "fx", path), number(json, "fy", path), cx, cy)
               : orthographic(width, height, number(json, "spacing_x", path), number(json, "spacing_y", path), cx, cy);
  } catch (Error const& error) {
    throw Error(error.code(), path, error.message());
  }
}

Json pose_to_json(Eigen::Isometry3d const& pose) {
  Json json = Json::array();
  for (int row = 0; row < 4; ++row)
    for (int column = 0; column < 4; ++column) json.push_back(pose.matrix()(row, column));
  return json;
}

Eigen::Isometry3d pose_from_json(Json const& json, std::filesystem::path const& path, std::string const& what) {
  if (!json.is_array() || json.size() != 16) throw Error(ErrorCode::bad_input, path, what + " is not 16 numbers");
  Eigen::Matrix4d matrix;
  for (int i = 0; i < 16; ++i) {
    if (!json[i].is_number()) throw Error(ErrorCode::bad_input, path, what + " is not 16 numbers");
    matrix(i / 4, i % 4) = json[i].get<double>();
  }
  return pose_from_matrix(matrix, path, what);
}

Eigen::Isometry3d pose_from_matrix(Eigen::Matrix4d const& matrix, std::filesystem::path const& path,
                                   std::string const& what) {
  constexpr double kTolerance = 1e-3;  // poses are written with four digits by some programs
  if (!matrix.allFinite()) throw Error(ErrorCode::bad_input, path, what + " has a number that is not finite");
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > kTolerance)
    throw Error(ErrorCode::bad_input, path, what + ": the last row is not 0 0 0 1");
  Eigen::Matrix3d const linear = matrix.topLeftCorner<3, 3>();
  if ((linear.transpose() * linear - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() > kTolerance ||
      linear.determinant() < 0)
    throw Error(ErrorCode::bad_input, path, what + " is no rotation");
  // A matrix that already is a rotation to rounding stays as it is, so that writing and reading give the same bits.
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.translation() = matrix.topRightCorner<3, 1>();
  bool const exact = (linear.transpose() * linear - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() < 1e-12;
  if (exact) {
    pose.linear() = linear;
  } else {
    Eigen::JacobiSVD<Eigen::Matrix3d> const svd(linear, Eigen::ComputeFullU | Eigen::ComputeFullV);
    pose.linear() = svd.matrixU() * svd.matrixV().transpose();
  }
  return pose;
}

Eigen::Isometry3d pose_from_quaternion(Eigen::Quaterniond const& target_from_source, Eigen::Vector3d const& translation,
                                       std::filesystem::path const& path, std::string const& what) {
  if (!translation.allFinite() || !target_from_source.coeffs().allFinite())
    throw Error(ErrorCode::bad_input, path, what + " has a number that is not finite");
  if (std::abs(target_from_source.norm() - 1) > 1e-2) throw Error(ErrorCode::bad_input, path, what + " is no rotation");
  return Eigen::Translation3d(translation) * target_from_source.normalized();
}

}  // namespace scanview
