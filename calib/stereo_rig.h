#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <string>

#include "calib/camera.h"
#include "calib/lens.h"

namespace scanview {

/// A camera as it is: the ideal camera and the lens before it. A ray (x/z, y/z) is bent by the lens, then projected:
/// u = fx x' + cx, v = fy y' + cy.
struct LensCamera {
  Camera camera;
  Lens lens;

  /// Pixel of a point in camera coordinates, through the lens; z must be positive (NaN otherwise).
  Eigen::Vector2d project(Eigen::Vector3d const& p_camera) const;
  /// The ray through a pixel of the distorted picture, z = 1; NaN where the lens has no inverse.
  Eigen::Vector3d ray(Eigen::Vector2d const& pixel) const;
};

/// {"width", "height", "fx", "fy", "cx", "cy", "distortion"}, the last optional; throws Error{bad_input, path}. `key`
/// is what messages call the object.
LensCamera lens_camera_from_json(Json const& json, std::string const& key, std::filesystem::path const& path);

/// Two cameras that are fixed to each other.
struct StereoRig {
  LensCamera left, right;
  Eigen::Isometry3d right_from_left = Eigen::Isometry3d::Identity();  ///< OpenCV's R, T
  std::string unit = "mm";                                            ///< of T: mm, m or arbitrary
  /// Standard deviation of each parameter where a calibration knows it: "left.fx", "right.k1", "rotation.x" (radians),
  /// "translation.x" ... Parameters that were held are absent.
  std::map<std::string, double> standard_deviations;

  double baseline() const { return right_from_left.translation().norm(); }
};

/// OpenCV's YAML (or XML, JSON) storage: M1 D1 M2 D2 R T, as its samples write it, and image_width, image_height, where
/// they are known (right_image_width, right_image_height where the right picture differs), unit, standard_deviations.
/// Without an image size cameras have the size that `fallback_size` says. Throws Error{bad_input, path} naming the
/// entry that is missing or makes no sense (R no rotation, T zero, focal length not positive).
StereoRig read_stereo_rig(std::filesystem::path const& path, cv::Size fallback_size = {});
/// Whole or not at all, as YAML; OpenCV's own samples read it back.
void write_stereo_rig(std::filesystem::path const& path, StereoRig const& rig);

}  // namespace scanview
