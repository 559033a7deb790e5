#pragma once
#include "base/context.h"
#include "mesh/depth_field.h"
#include "mesh/depth_triangulation.h"
#include "mesh/surface_links.h"

namespace scanview {

/// Gives new vertices their depths, and puts vertices on the border where triangles beside it would be flat.
class VertexMaker {
 public:
  VertexMaker(RangeImage const& image, SurfaceLinks const& links, cv::Mat1f const& tolerance, bool smooth)
      : image_(image), links_(links), tolerance_(tolerance), smooth_(smooth) {}

  bool is_perspective() const { return image_.camera.is_perspective(); }
  /// Linear depth of a vertex at a pixel of the object: its own, or, smooth, that of fit_local_surface().
  double depth_at(int x, int y) const;
  /// Halves a border edge of the triangle that is long beside a point so near to it (an angle of more than 135 degrees
  /// at the point), at the foot of the point, so that no sliver lies along it whose normal means nothing. The vertex
  /// that it made, or −1 where no edge is so (held vertices keep theirs whole), or where vertices are plain, not
  /// smooth.
  int split_border(DepthTriangulation& triangulation, int t, Eigen::Vector2d const& point) const;
  /// Halves the border edge opposite corner i where the surface beside it is farther off its line than anywhere else
  /// along it and by more than `limit` tolerances: no pixel's error tells, for none lies on it, but from the side it
  /// would be seen as a skin that hangs in a depth step. The vertex, or −1 where the edge keeps the limit or is held.
  int split_border_off(DepthTriangulation& triangulation, int t, int i, DepthField const& field, double limit) const;

 private:
  /// The linear depth of a place on a border edge from u to v, by the nearest pixel of the object on the edge's side.
  struct BorderDepth {
    double depth = 0;
    int x = -1, y = -1;  ///< that pixel; −1: none is near
  };
  BorderDepth border_depth(Eigen::Vector2d const& place, Eigen::Vector2d const& edge) const;

  RangeImage const& image_;
  SurfaceLinks const& links_;
  cv::Mat1f const& tolerance_;
  bool smooth_;
};

/// Gives the border vertices wherever VertexMaker::split_border_off() finds it off by more than `limit` tolerances, but
/// makes no more than `max_triangles` (0: no limit). Linear in the border's pixels, times the depth of the halving.
void refine_border(DepthTriangulation& triangulation, DepthField const& field, VertexMaker const& maker, double limit,
                   int max_triangles);

/// Refines a triangulation by greedy insertion (Garland and Heckbert 1995, algorithm III): of all pixels the one that
/// is worst off, by error in tolerances, becomes a vertex, edges around it are flipped until they are Delaunay, only
/// the triangles around it are looked at again, and so on until no error is beyond `limit` tolerances or the next
/// vertex would make more than `max_triangles` (0: no limit). Where the worst pixel lies near the border, the border
/// may get a vertex first (VertexMaker). About n log n for n pixels. Errors are those of single precision.
void insert_greedily(DepthTriangulation& triangulation, DepthField const& field, VertexMaker const& maker, double limit,
                     int max_triangles, Context& context);

}  // namespace scanview
