#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/html.h"
#include "viewer/renderer.h"

namespace scanview {

/// One frame's camera.
struct PathCamera {
  Camera camera;
  Eigen::Isometry3d object_from_camera;
  std::string name;  ///< "000", or the views it lies between
};

/// Looks from `eye` at `target` with `up` up in the picture; where `up` is parallel to the line of sight, any
/// direction.
Eigen::Isometry3d look_at(Eigen::Vector3d const& eye, Eigen::Vector3d const& target, Eigen::Vector3d const& up);

/// How a person would walk around the object: all in object coordinates.
struct OrbitFrame {
  Eigen::Vector3d up;     ///< unit: the axis of the circle that the eyes lie on; otherwise the mean of the cameras' up
  Eigen::Vector3d start;  ///< unit: direction from the centre to the first eye, at the mean elevation
  double distance = 0;    ///< of the eye from the centre: the median of the perspective cameras'
  double radius = 0;      ///< of the object (ScanSet::radius), never 0
};
/// Throws Error{bad_input} where a view has no pose.
OrbitFrame orbit_frame(ScanSet const& set);
/// The same of a set without depth images (ViewLibrary::set), whose object has this radius.
OrbitFrame orbit_frame(ScanSet const& set, double radius);

/// A perspective camera that looks at the centre from `direction` and holds the object's sphere with a margin of a
/// tenth. Where the eye is inside the sphere (a room), a field of view of 60 degrees.
PathCamera framing_camera(ScanSet const& set, OrbitFrame const& frame, Eigen::Vector3d const& direction, int width,
                          int height);

/// A full turn about `up` in `count` steps, starting at the first view.
std::vector<PathCamera> orbit_path(ScanSet const& set, OrbitFrame const& frame, int count, int width, int height);
inline std::vector<PathCamera> orbit_path(ScanSet const& set, int count, int width, int height) {
  return orbit_path(set, orbit_frame(set), count, width, height);
}

/// The same view in a picture of another size: whole and undistorted, with margins where the aspects differ.
Camera fit_camera(Camera const& camera, int width, int height);

/// The camera of a view in a picture of another size (fit_camera). Throws Error{usage} where there is no such view.
PathCamera camera_like(ScanSet const& set, std::string const& view_name, int width, int height);

/// Halfway between consecutive views (and between last and first, where that gap is no wider than one and a half times
/// the median gap): eye on the great arc about the centre, orientation by slerp. Orthographic views: framing cameras.
std::vector<PathCamera> halfway_path(ScanSet const& set, OrbitFrame const& frame, int width, int height);
inline std::vector<PathCamera> halfway_path(ScanSet const& set, int width, int height) {
  return halfway_path(set, orbit_frame(set), width, height);
}

/// From the first view to the last through all between them, `count` frames in even steps: on arcs about the centre, or
/// straight where the eyes are inside the object's sphere (a room). Each frame has the camera of the view it is nearest
/// to. Where a view is orthographic: an orbit.
std::vector<PathCamera> path_through_views(ScanSet const& set, OrbitFrame const& frame, int count, int width,
                                           int height);

/// How an eye gets from one keyframe to the next: on an arc about the set's centre, or straight on.
enum class PathMotion { about_center, straight };

/// A camera path file: {"format": 1, "keyframes": [{"camera": {...} (optional), "object_from_camera": [16]}, ...],
/// "between": frames from one keyframe to the next, not counting its end (default 1: keyframes only)}. Throws
/// Error{bad_input}.
std::vector<PathCamera> read_camera_path(std::filesystem::path const& path, ScanSet const& set, OrbitFrame const& frame,
                                         int width, int height, PathMotion motion = PathMotion::about_center);
inline std::vector<PathCamera> read_camera_path(std::filesystem::path const& path, ScanSet const& set, int width,
                                                int height) {
  return read_camera_path(path, set, orbit_frame(set), width, height);
}

/// The film strip of an orbit.
ReportSection render_section(std::vector<PathCamera> const& path, std::vector<Frame> const& frames);

}  // namespace scanview
