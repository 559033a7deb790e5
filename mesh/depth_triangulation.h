#pragma once
#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "calib/camera.h"
#include "mesh/depth_field.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// A triangulation over the picture whose vertices carry linear depth: what all ways to place vertices make and what
/// the fit improves. Its border (the outline, and both sides of step edges, each with its own vertices) stays where it
/// is. All changes keep every triangle's corners turning from x to y, by more than rounding can undo, so that no
/// triangle can fold over another; whether an edge is Delaunay is decided exactly (CGAL).
class DepthTriangulation {
 public:
  struct Vertex {
    Eigen::Vector2d position;  ///< pixels
    double depth = 0;          ///< linear
    bool on_border = false;
    bool is_held = false;  ///< no fit changes its depth: another picture's mesh has the same vertex
    int triangle = -1;     ///< one around it; −1: removed
  };
  struct Triangle {
    std::array<int, 3> vertex;  ///< from x to y; −1: removed
    std::array<int, 3> next;    ///< across the edge opposite corner i; −1: border
  };

  int add_vertex(Eigen::Vector2d const& position, double depth, bool on_border);
  /// Between three vertices that turn from x to y. Call connect() when all are there.
  int add_triangle(int a, int b, int c);
  /// Finds the neighbours of all triangles; an edge of one triangle alone is border.
  void connect();

  std::vector<Vertex> const& vertices() const { return vertices_; }
  std::vector<Triangle> const& triangles() const { return triangles_; }
  Vertex const& vertex(int v) const { return vertices_[v]; }
  Triangle const& triangle(int t) const { return triangles_[t]; }
  bool alive(int t) const { return triangles_[t].vertex[0] >= 0; }
  int count() const { return count_; }  ///< triangles that are there
  int count_vertices() const;           ///< that are there
  void set_depth(int v, double depth) { vertices_[v].depth = depth; }
  /// Of the border.
  void hold(int v, double depth) {
    vertices_[v].depth = depth;
    vertices_[v].is_held = true;
  }

  /// Leaves out what was removed and orders triangles and vertices by place, square after square of the picture, so
  /// that whoever goes through them finds the pixels in the cache.
  void order_by_place();

  DepthTriangle shape(int t) const;
  int corner_of(int t, int v) const;     ///< which corner of the triangle the vertex is
  int opposite_of(int t, int to) const;  ///< which edge of the triangle leads to triangle `to`
  /// The triangles around a vertex, in the order in which their far edges follow each other.
  void triangles_around(int v, std::vector<int>& out) const;

  /// Puts a vertex into a triangle, or on an edge where the point lies on one: two triangles more, one at the border.
  /// Nothing where a corner is there already. The point must lie in the triangle or on its edges.
  std::optional<int> insert(int t, Eigen::Vector2d const& position, double depth);
  /// Halves the edge opposite corner i.
  int split_edge(int t, int i, Eigen::Vector2d const& position, double depth);
  /// Whether the two triangles at an edge make a convex quadrilateral.
  bool can_flip(int t, int i) const;
  /// Turns the edge opposite corner i: its triangles are then (a, b, d) at t, (a, d, c) at its neighbour.
  void flip(int t, int i);
  /// Whether the circle through the triangle's corners holds the neighbour's far corner (a Delaunay edge: no).
  bool breaks_delaunay(int t, int i) const;
  /// Flips edges around a new vertex until they are Delaunay again (Lawson).
  void restore_delaunay(int v);
  /// Whether a vertex of the inside may go to a place with all triangles around it staying as they turn.
  bool can_move(int v, Eigen::Vector2d const& position) const;
  void move(int v, Eigen::Vector2d const& position, double depth);
  /// Whether vertex v of the inside may be joined with its neighbour u.
  bool can_collapse(int v, int u) const;
  /// Joins v with u: v and two triangles go.
  void collapse(int v, int u);

  /// Moves every vertex to where it is once it was written in single precision, in camera coordinates.
  void round_to_single(Camera const& camera);
  /// In camera coordinates, normals (b − a) × (c − a) towards the camera.
  TriangleMesh to_mesh(Camera const& camera) const;

 private:
  void relink(int t, int from, int to);

  std::vector<Vertex> vertices_;
  std::vector<Triangle> triangles_;
  int count_ = 0;
};

}  // namespace scanview
