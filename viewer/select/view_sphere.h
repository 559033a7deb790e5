#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <vector>

namespace scanview {

/// How much each view counts for an eye: indices of views with their weight, positive, summing to 1.
struct ViewWeight {
  std::size_t view = 0;
  double weight = 0;
};

/// The sphere of viewing directions (Pulli 1997): source cameras as unit vectors from the object's centre, their
/// Delaunay triangulation (the convex hull of the vectors), and barycentric weights for an eye.
///
/// Weights are continuous in the eye's direction everywhere (the centre itself apart), non-negative, sum to 1, are 1
/// for a view the eye is at, and shared by views in the same direction (within a microradian).
///
/// Where a round cap of more than 55 degrees holds no view (one view, two views, above and below a turntable, the far
/// side of a hemisphere), the paper's triangle would either not exist or span views from opposite sides. There a
/// virtual direction fills the cap. Its barycentric share goes to the views of its triangle in proportion to theirs, so
/// that on a turntable the weights depend on the azimuth alone; only near the virtual direction itself (where the real
/// share is below 0.35) they fade into an equal mixture of up to three views around it. Continuity holds by
/// construction, since all of it is a continuous function of barycentric coordinates on one triangulation that has the
/// centre inside.
class ViewSphere {
 public:
  /// Directions need not be unit; zero or non-finite ones throw Error{bad_input}. At least one.
  explicit ViewSphere(std::vector<Eigen::Vector3d> const& directions);
  /// Ordered by view. Two or three views where they surround the eye (more only where directions coincide), up to seven
  /// near the middle of an empty cap. `face`, where given, is a place to keep the face between calls: location walks
  /// from it, a few faces for an eye that moved a little, about the square root of their number from anywhere. The
  /// result does not depend on it.
  std::vector<ViewWeight> weights(Eigen::Vector3d const& direction, std::size_t& face) const;
  std::vector<ViewWeight> weights(Eigen::Vector3d const& direction) const {
    std::size_t face = 0;
    return weights(direction, face);
  }
  /// Triangles of the sphere whose corners are all views (of coinciding views the first), counter-clockwise seen from
  /// outside, for drawing; none on a turntable.
  std::vector<Eigen::Vector3i> const& triangles() const { return triangles_; }

 private:
  void fill_caps();
  void mix_for_virtual_corners();
  void link_faces();
  Eigen::Vector3d share_of(Eigen::Vector3d const& eye, std::size_t face) const;
  std::size_t locate(Eigen::Vector3d const& eye, std::size_t face) const;

  std::vector<Eigen::Vector3d> corners_;            ///< distinct directions of views, then virtual ones
  std::vector<std::vector<std::size_t>> views_at_;  ///< views of each real corner
  std::vector<std::vector<std::size_t>> mixture_;   ///< of each virtual corner: real corners, equally
  std::vector<Eigen::Vector3i> faces_;              ///< of all corners
  std::vector<Eigen::Vector3i> across_;             ///< the face across the edge opposite to each corner
  std::vector<Eigen::Vector3i> triangles_;
};

}  // namespace scanview
