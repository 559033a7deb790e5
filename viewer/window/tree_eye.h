#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <optional>
#include <vector>

#include "viewer/layered/ldi_tree.h"
#include "viewer/window/orbit_control.h"
#include "viewer/window/walk_control.h"

namespace scanview {

/// Which way is up: at right angles to all cameras' horizontal axes, where these differ enough to tell; otherwise the
/// mean of their upward axes. A coordinate axis that is within five degrees of it stands in for it. Unit length; y
/// where there are no views.
Eigen::Vector3d up_of_views(std::vector<View> const& views);

/// Whether most views look from outside at something that is about `center`, all of it within `radius`.
bool look_inwards(std::vector<View> const& views, Eigen::Vector3d const& center, double radius);

/// The eye of somebody who looks at an LDI tree: goes around the object, or walks in the scene, and may change from one
/// to the other wherever it is. Knows nothing of windows.
class TreeEye {
 public:
  enum class Mode { orbit, walk };

  /// Begins around an object, framing it, where its views look inwards; else walking, at the first view.
  explicit TreeEye(LdiTree const& tree);

  Mode mode() const { return mode_; }
  PathCamera current() const;
  void reset();
  /// The eye stays where it is; the horizon becomes level to walk. pivot: to turn about from now on.
  void change_mode(Eigen::Vector3d const& pivot);
  /// To a reference view: with its own camera, or to walk on from its place. False where there is none of that index.
  bool jump(std::size_t view);
  /// The reference view that so many steps lead to, from the one that was last jumped to; nothing without views.
  std::optional<std::size_t> view_after(int steps) const;
  /// The reference view nearest to the tree's centre; nothing without views.
  std::optional<std::size_t> middle_view() const;
  /// About up, in degrees: around the object, or the eye alone.
  void turn(double degrees);
  /// Shares of the tree's radius; walking alone.
  void walk(WalkStep step);

  OrbitControl& orbit() { return orbit_; }
  OrbitControl const& orbit() const { return orbit_; }
  WalkControl& walker() { return walker_; }

 private:
  void look_along(Eigen::Isometry3d const& object_from_camera);

  std::vector<View> views_;
  Eigen::Vector3d center_;
  double radius_;
  Mode start_, mode_;
  OrbitControl orbit_;
  WalkControl walker_;
  std::optional<std::size_t> view_;
};

}  // namespace scanview
