#pragma once
#include <Eigen/Geometry>
#include <array>

#include "viewer/window/walk_control.h"

namespace scanview {

/// A plan of a scene, seen from above: places are in units of its width, from its upper left corner, x east, y south.
struct GroundMap {
  static constexpr double kHeight = 0.62;  ///< of the drawing, to its width
  Eigen::Vector2d eye{0, 0};
  std::array<Eigen::Vector2d, 2> view = {};  ///< ends of the rays at the left and at the right of the picture
  double bar = 0;                            ///< a round length of the scene, to show the scale by
  double bar_width = 0;                      ///< of the drawing
};

/// Where on such a plan a point of the scene is.
class GroundPlan {
 public:
  /// extent: what must be on it, as on_ground() says; it shows at least `least` (not 0) in each direction.
  GroundPlan(Ground const& ground, Eigen::AlignedBox2d const& extent, double least);
  static Eigen::Vector2d on_ground(Ground const& ground, Eigen::Vector3d const& p);  ///< in the scene's unit
  Eigen::Vector2d place(Eigen::Vector3d const& p) const;
  /// Everything but what else is on the map. width_deg: of the picture, seen from the eye.
  void add_eye_and_bar(GroundMap& map, Eigen::Vector3d const& eye, double heading_deg, double width_deg) const;

 private:
  Ground ground_;
  Eigen::Vector2d middle_;
  double scale_;
};

}  // namespace scanview
