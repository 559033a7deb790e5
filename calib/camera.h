#pragma once
#include <Eigen/Geometry>
#include <string>

#include "base/files.h"

namespace scanview {

/// An ideal camera without distortion. It looks along +z, x right, y down (OpenCV). The centre of the top-left pixel is
/// (0, 0). Depth is z along the axis, in the set's unit, not the length of the ray.
///   perspective:  u = fx x/z + cx,          v = fy y/z + cy
///   orthographic: u = x / spacing_x + cx,   v = y / spacing_y + cy   (spacing: units a pixel)
class Camera {
 public:
  enum class Model { perspective, orthographic };

  static Camera perspective(int width, int height, double fx, double fy, double cx, double cy);
  static Camera orthographic(int width, int height, double spacing_x, double spacing_y, double cx, double cy);

  Camera() = default;
  Model model() const { return model_; }
  bool is_perspective() const { return model_ == Model::perspective; }
  int width() const { return width_; }
  int height() const { return height_; }
  /// Focal lengths in pixels (perspective), or pixels a unit, 1/spacing (orthographic).
  double fx() const { return fx_; }
  double fy() const { return fy_; }
  double cx() const { return cx_; }
  double cy() const { return cy_; }

  /// Pixel of a point in camera coordinates. Perspective: z must be positive (NaN otherwise).
  Eigen::Vector2d project(Eigen::Vector3d const& p_camera) const;
  /// The point of pixel (u, v) at depth z, in camera coordinates.
  Eigen::Vector3d unproject(double u, double v, double z) const;
  /// The ray through a pixel: from the origin, direction with z = 1 (perspective); from (x, y, 0) along z
  /// (orthographic).
  Eigen::Vector3d ray_origin(double u, double v) const;
  Eigen::Vector3d ray_direction(double u, double v) const;
  /// Width of a pixel at depth z on a plane facing the camera, in units: the sampling density's inverse.
  double pixel_size(double z) const { return is_perspective() ? z / fx_ : 1.0 / fx_; }
  bool contains(Eigen::Vector2d const& pixel) const;  ///< within the picture's outline, -0.5 .. size - 0.5

  /// The same view in a picture of another size (pixel areas keep their place: u' + ½ = s (u + ½)).
  Camera resized(int width, int height) const;
  /// The part of the picture that starts at pixel (x, y).
  Camera cropped(int x, int y, int width, int height) const;

  Json to_json() const;
  /// Throws Error{bad_input, path} naming the field that is missing, unknown, or out of range.
  static Camera from_json(Json const& json, std::filesystem::path const& path);
  bool operator==(Camera const&) const = default;

 private:
  void validate() const;
  Model model_ = Model::perspective;
  int width_ = 0, height_ = 0;
  double fx_ = 1, fy_ = 1, cx_ = 0, cy_ = 0;
  double spacing_x_ = 1, spacing_y_ = 1;  ///< orthographic: kept beside fx, so that files round-trip bit by bit
};

/// Row by row, 16 numbers. Reading checks the last row, finiteness, and that the upper left is a rotation
/// (|RᵀR − 1| and |det − 1| below 1e-3, then orthonormalised): otherwise Error{bad_input, path} naming `what`.
Json pose_to_json(Eigen::Isometry3d const& pose);
Eigen::Isometry3d pose_from_json(Json const& json, std::filesystem::path const& path, std::string const& what);
Eigen::Isometry3d pose_from_matrix(Eigen::Matrix4d const& matrix, std::filesystem::path const& path,
                                   std::string const& what);
/// A rotation and a translation; |q| may be off by a hundredth, as quaternions of few digits are. Errors as above.
Eigen::Isometry3d pose_from_quaternion(Eigen::Quaterniond const& target_from_source, Eigen::Vector3d const& translation,
                                       std::filesystem::path const& path, std::string const& what);

}  // namespace scanview
