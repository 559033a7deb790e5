#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "viewer/select/view_selection.h"

namespace scanview {

/// A place in the inset: within the unit disc, x right, y down.
struct SpherePoint {
  double x = 0, y = 0;
  bool front = true;  ///< on the half that faces the person
};

/// The sphere of viewing directions as a small drawing, seen as the camera sees the object: the eye is near its middle.
struct SphereInset {
  struct ViewDot {
    std::size_t view = 0;
    SpherePoint at;
    double weight = 0;   ///< of the views that are drawn
    bool drawn = false;  ///< with weight, or to fill
  };
  struct Edge {
    std::vector<SpherePoint> arc;
    bool chosen = false;  ///< between two views with weight
  };
  std::vector<ViewDot> views;
  std::vector<Edge> edges;
  std::vector<SpherePoint> chosen;  ///< corners of the chosen triangle, or of what the views with weight span
  SpherePoint eye;

  /// The view whose dot is nearest to a place and within `reach` of it; dots at the front go first. views.size() where
  /// there is none.
  std::size_t nearest(double x, double y, double reach) const;
};

/// `directions` of all views and `eye` are unit vectors from the object's centre; `triangles` hold views;
/// `object_from_camera` says what is right and down.
SphereInset sphere_inset(std::vector<Eigen::Vector3d> const& directions, std::vector<Eigen::Vector3i> const& triangles,
                         std::vector<UsedView> const& used, Eigen::Vector3d const& eye,
                         Eigen::Matrix3d const& object_from_camera);

}  // namespace scanview
