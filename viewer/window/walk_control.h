#pragma once
#include <Eigen/Geometry>
#include <optional>

#include "viewer/select/camera_path.h"

namespace scanview {

/// Axes of the ground of a scene, as a map has them: unit vectors, at right angles to one another, and east × north is
/// up. North is − z where y is up, y where z is up.
struct Ground {
  Eigen::Vector3d up, east, north;
  /// up: not 0; of any length.
  explicit Ground(Eigen::Vector3d const& up);
};

/// A wish to move: lengths, and an angle to the right in degrees.
struct WalkStep {
  double forward = 0, right = 0, up = 0, turn_deg = 0;
  WalkStep& operator+=(WalkStep const& other);
  WalkStep operator*(double times) const;
};

/// The eye of somebody who walks: a position, a heading and a pitch; the horizon is always level. Walking keeps the
/// height above the ground, wherever the eye looks. Knows nothing of windows and keys.
class WalkControl {
 public:
  /// The eye stays in the box, where there is one and it is not free. Begins at the origin, heading north.
  WalkControl(Eigen::Vector3d const& up, std::optional<Eigen::AlignedBox3d> const& box);

  Ground const& ground() const { return ground_; }
  Eigen::Vector3d const& eye() const { return eye_; }
  double heading_deg() const { return heading_deg_; }  ///< clockwise from north, seen from above; 0 to 360
  double pitch_deg() const { return pitch_deg_; }      ///< upwards
  static constexpr double kSteepestDeg = 89;           ///< of the pitch; beyond it is held there
  Eigen::Isometry3d scene_from_camera() const;
  /// 60 degrees high, 4 : 3; in pictures of other sizes: fit_camera().
  Camera camera() const;

  /// Any place, also outside the box.
  void stand_at(Eigen::Vector3d const& eye) { eye_ = eye; }
  void face(double heading_deg, double pitch_deg);
  /// Level, towards where a point lies on the ground; as before where it is right above or below.
  void face(Eigen::Vector3d const& p_scene);
  /// Walks and turns at once, along an arc: in however many parts a step is taken, it ends at the same place. At the
  /// box the eye slides along; from outside it can only come nearer. Whether the box held it back.
  enum class Walked { freely, held_back };
  Walked walk(WalkStep const& step);
  /// Turns so that what was seen at pixel `from` of a camera is seen at `to`, but for what the steepest pitch and the
  /// level horizon do not allow.
  void drag(Camera const& camera, Eigen::Vector2d const& from, Eigen::Vector2d const& to);

  bool is_free = false;  ///< the box does not hold

 private:
  Ground ground_;
  std::optional<Eigen::AlignedBox3d> box_;
  Eigen::Vector3d eye_{0, 0, 0};
  double heading_deg_ = 0, pitch_deg_ = 0;
};

}  // namespace scanview
