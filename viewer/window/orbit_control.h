#pragma once
#include <Eigen/Geometry>

#include "viewer/select/camera_path.h"

namespace scanview {

/// The eye of an interactive window: turns about a pivot, pans, comes nearer. Knows nothing of windows; lengths on the
/// screen are shares of the window's height, so that dragging feels the same in any size.
class OrbitControl {
 public:
  /// `radius` is the object's (ViewLibrary::radius). Throws Error{bad_input} where a view has no pose.
  OrbitControl(ScanSet const& set, double radius) : OrbitControl(set, orbit_frame(set, radius)) {}
  /// With another idea of how to go around it than orbit_frame()'s.
  OrbitControl(ScanSet const& set, OrbitFrame const& frame);
  /// Of something that has no views, about its centre: begins where framing_camera() stands.
  OrbitControl(Eigen::Vector3d const& center, OrbitFrame const& frame);
  PathCamera const& current() const { return current_; }
  /// Looks from where `other` does, about its pivot: after the set has changed under it.
  void take_eye_of(OrbitControl const& other) { take_eye(other.current_, other.pivot_); }
  void take_eye(PathCamera const& eye, Eigen::Vector3d const& pivot);

  void reset();
  /// About the set's up direction and the camera's horizontal axis; never over the poles. A full height is half a turn.
  void orbit(double right, double down);
  /// Moves eye and pivot in the picture's plane so that what is at the pivot's depth follows the pointer.
  void pan(double right, double down);
  /// Brings the eye nearer (positive) to the pivot or takes it away, a tenth a step; never through it.
  void zoom(double steps);
  /// Degrees about up: what the turntable does.
  void turn(double degrees);
  /// The camera of a view: for an orthographic one a perspective camera from the same direction. False where there is
  /// none of that index.
  bool jump(std::size_t view);
  /// A point of the object that is turned about from now on; the eye stays.
  void set_pivot(Eigen::Vector3d const& p_object) { pivot_ = p_object; }
  Eigen::Vector3d const& pivot() const { return pivot_; }

 private:
  void rotate(Eigen::AngleAxisd const& rotation);

  Eigen::Vector3d center_;
  OrbitFrame frame_;
  PathCamera start_;
  std::vector<PathCamera> views_;
  PathCamera current_;
  Eigen::Vector3d pivot_;
};

}  // namespace scanview
