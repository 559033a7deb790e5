#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "acquire/camera_light.h"
#include "acquire/range_image.h"

namespace scanview {

/// One capture position: what was seen, and where from.
struct View {
  std::string name;  ///< "000"; the folder's name
  RangeImage image;
  std::optional<Eigen::Isometry3d> object_from_camera;  ///< object_from_camera * p_camera = p_object
  Eigen::Vector3d gain{1, 1, 1};                        ///< R, G, B in linear light, applied when rendering

  /// Where the camera is, in object coordinates; of an orthographic camera, the centre of its image plane.
  Eigen::Vector3d eye() const;
};

enum class Unit { mm, m, arbitrary };
std::string to_string(Unit unit);  ///< "mm", "m", "arbitrary"
Unit unit_from_string(std::string const& name, std::filesystem::path const& path);

/// One source of error, in units; NaN where it is not known yet.
struct ErrorPart {
  double rms = std::numeric_limits<double>::quiet_NaN();
  double p95 = std::numeric_limits<double>::quiet_NaN();
};

/// What the views of a set may differ by on one surface (Pulli 1997, soft z-buffering: "sampling, registration and
/// polygonal approximation errors").
struct ErrorBudget {
  ErrorPart sampling;       ///< noise of a depth
  ErrorPart registration;   ///< distance between overlapping views
  ErrorPart approximation;  ///< distance from range image to mesh
  /// Soft z threshold: sum of the known 95th percentiles ("slightly exceeds an upper estimate of the combination").
  /// 0 where nothing is known.
  double threshold() const;
};

struct ScanSet {
  Unit unit = Unit::m;
  Eigen::Vector3d center{0, 0, 0};  ///< of the object, in object coordinates: what the view sphere looks at
  std::vector<View> views;
  ErrorBudget error_budget;
  std::optional<CameraLight> light;  ///< where the views show that it stood still with the camera

  bool has_poses() const;  ///< every view has one, and there is at least one view
  /// Radius about `center` that holds 99 % of all depths (thinned): the object's size for tolerances, cameras, spectra.
  double radius() const;
};

/// Component-wise median of all depths in object coordinates, over views with poses (thinned to about 100 000 points);
/// the origin where there are none.
Eigen::Vector3d median_center(ScanSet const& set);

}  // namespace scanview
