#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "viewer/renderer.h"
#include "viewer/window/overlay.h"

namespace scanview {

/// A frame with the camera that it was drawn from: what a person sees and clicks on, while the eye may have moved on.
struct ShownFrame {
  Frame frame;
  Camera camera;  ///< of the frame's size
  Eigen::Isometry3d object_from_camera = Eigen::Isometry3d::Identity();

  /// The point of the object, in its coordinates, under a pixel of the frame shown `width` by `height` pixels large;
  /// nothing on the background or outside the picture.
  std::optional<Eigen::Vector3d> pick(double x, double y, int width, int height) const;
  /// Where a point of the object is in a picture of that size; nothing behind the eye.
  std::optional<Eigen::Vector2d> place(Eigen::Vector3d const& p_object, int width, int height) const;
};

/// Two clicked points and their distance.
class DistanceTool {
 public:
  /// A third point begins anew. What missed the object (nothing) changes nothing.
  void click(std::optional<Eigen::Vector3d> const& p_object);
  void remove_last();
  void clear() { points_.clear(); }
  std::vector<Eigen::Vector3d> const& points() const { return points_; }  ///< at most two, object coordinates
  std::optional<double> distance() const;                                 ///< in the set's unit
  /// Over the frame, shown that large.
  Overlay overlay(ShownFrame const& shown, int width, int height, Unit unit) const;

 private:
  std::vector<Eigen::Vector3d> points_;
};

/// "12.35 mm", "0.1235 m", "1.235 (no known scale)": four digits.
std::string length_text(double length, Unit unit);

}  // namespace scanview
