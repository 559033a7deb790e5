#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <vector>

#include "mesh/triangle_mesh.h"

namespace scanview {

/// A surface of one colour over a grid of columns x rows cells, two triangles each. Its outside is where, of the
/// directions of growing column, growing row and the outside, each is counter-clockwise from the one before.
struct Patch {
  int columns = 1, rows = 1;
  enum class Closed { no, around } closed = Closed::no;  ///< around: the last column's end is the first one's start
  enum class Pole { none, first, last, both } pole = Pole::none;  ///< which end's line of vertices is one point
  cv::Vec3b color;                                                ///< sRGB, BGR
  std::function<Eigen::Vector3d(int column, int row)> point;      ///< of the grid's vertices: 0 .. columns, 0 .. rows
};

/// Collects patches into a mesh whose edges are about so long, or only counts their triangles (without asking for any
/// point), so that a length can be found with which a mesh has the size that is wanted. Patches share no vertices;
/// where they meet, so do their vertices, if their points are computed alike.
class PatchWriter {
 public:
  /// Counts; `mesh` not null: also appends to it. `edge` in the points' unit, above 0.
  explicit PatchWriter(double edge, TriangleMesh* mesh = nullptr) : edge_(edge), mesh_(mesh) {}

  void add(Patch const& patch);
  std::size_t triangles() const { return triangles_; }
  std::size_t vertices() const { return vertices_; }

  /// Steps that a way of this length is divided into: at least `least`.
  int steps(double length, int least = 1) const;
  /// The same around something round, which shows its corners sooner: three times as many.
  int round_steps(double length, int least) const { return steps(3 * length, least); }
  /// Places 0 .. of the lines and of what divides the ways between them, each at least once. All ways with the same
  /// lines are divided alike, and on average as finely as `edge` says.
  std::vector<std::vector<double>> divided(std::vector<double> const& lines) const;

 private:
  double edge_;
  TriangleMesh* mesh_;
  std::size_t triangles_ = 0, vertices_ = 0;
};

/// The mesh of what `write` writes, with the length of edges whose number of triangles is nearest `polygons`.
TriangleMesh mesh_of_about(std::size_t polygons, std::function<void(PatchWriter&)> const& write);

}  // namespace scanview
