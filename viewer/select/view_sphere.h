#pragma once
#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace scanview {

/// How much each view counts for an eye: indices of views with their weight, positive, summing to 1.
struct ViewWeight {
  std::size_t view = 0;
  double weight = 0;
};

/// The sphere of viewing directions (Pulli 1997): source cameras as unit vectors from the object's centre, their
/// Delaunay triangulation (the convex hull of the vectors), and barycentric weights for an eye.
///
/// Weights are continuous in the eye's direction everywhere (the centre itself apart), non-negative, sum to 1, are 1 for a view the
/// eye is at, and shared by views in the same direction. Degenerate sets are defined: one view: weight 1. Two views, all views on one
/// great or small circle (a turntable), or all within a hemisphere: see the .cpp; no direction is left without weights.
class ViewSphere {
 public:
  /// Directions need not be unit; zero or non-finite ones throw Error{bad_input}. At least one.
  explicit ViewSphere(std::vector<Eigen::Vector3d> const& directions);
  /// At most three views with weights (more only where directions coincide), for a direction from the centre to the eye.
  std::vector<ViewWeight> weights(Eigen::Vector3d const& direction) const;
  /// Triangles of the sphere (indices of views), for drawing; empty where all views lie on one circle.
  std::vector<Eigen::Vector3i> const& triangles() const { return triangles_; }

 private:
  std::vector<Eigen::Vector3d> directions_;
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace scanview
