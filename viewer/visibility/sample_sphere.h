#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <vector>

namespace scanview {

/// Where samples are taken from: unit vectors from the model's centre, and the triangles between them.
class SampleSphere {
 public:
  /// The octahedron, each face cut into four `level` times and put back onto the sphere (Meruvia 2002, section 3.2.1):
  /// 6, 18, 66, 258, 1026, 4098, ... directions. Level 0 to 8.
  static SampleSphere octahedron(int level);
  /// The level with so many directions. Throws Error{usage} for any other number.
  static int octahedron_level(std::size_t directions);
  /// Any directions, triangulated by their convex hull (Meruvia 2001, section 3.2.1). Equal ones (within a
  /// microradian) count once. Hull faces that turn their back to the centre are none: cameras in one half-space cover
  /// only a part of the sphere, on one circle nothing. Zero or non-finite directions: Error{bad_input}.
  static SampleSphere hull(std::vector<Eigen::Vector3d> const& directions);

  std::vector<Eigen::Vector3d> const& directions() const { return directions_; }
  std::vector<Eigen::Vector3i> const& faces() const { return faces_; }  ///< counter-clockwise seen from outside
  /// Of each edge's far side, opposite to corner k: the third corner of the neighbouring face; −1: there is none.
  Eigen::Vector3i const& opposite(std::size_t face) const { return opposite_[face]; }
  bool is_octahedron() const { return octahedron_; }
  /// The share of all directions that lie in a face.
  double coverage() const;
  /// The largest angle between a point of a face and its nearest corner: half the distance of samples. In radians.
  double radius() const;
  /// Of each direction that was cut in between two others: those two, then the far corners of the faces on both sides
  /// of that edge. −1: it was not: a corner of the octahedron, or of a hull.
  std::vector<std::array<int, 4>> const& between() const { return between_; }
  /// The direction that stands for each of those given to hull().
  std::vector<std::size_t> const& representative() const { return representative_; }

  struct Location {
    std::size_t face = 0;
    int tests = 0;  ///< of a point against a plane through the centre
  };
  /// The face in that direction; one of those that meet there, if it lies on an edge. Nothing for the centre itself
  /// (and non-finite numbers), or where there is no face. Octahedron: three tests for the first level and at most
  /// three for each further one. Hull: linear.
  std::optional<Location> locate(Eigen::Vector3d const& direction) const;

 private:
  void link();

  std::vector<Eigen::Vector3d> directions_;
  std::vector<Eigen::Vector3i> faces_, opposite_;
  std::vector<std::array<int, 4>> between_;
  std::vector<std::size_t> representative_;
  /// The planes that cut off the corners of each face, level by level; child 3 is the middle.
  struct Cut {
    Eigen::Vector3d normal[3];
  };
  std::vector<std::vector<Cut>> cuts_;
  bool octahedron_ = false;
};

}  // namespace scanview
