#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

#include "calib/camera.h"
#include "mesh/depth_field.h"
#include "mesh/depth_triangulation.h"
#include "mesh/surface_links.h"

namespace scanview {

/// A side of a node while it is being triangulated.
struct SideTriangulation {
  Camera camera;
  Eigen::Matrix3d node_from_camera = Eigen::Matrix3d::Identity();
  SurfaceLinks links;
  DepthField field;
  DepthTriangulation triangulation;
  /// An edge of the picture, clockwise from the upper left corner: the linear depth, in this camera, of what lies
  /// beyond each of its pixels and is linked to it; 0: nothing is. May be empty.
  std::array<std::vector<double>, 4> beyond;
};

/// Gives sides whose pictures share an edge of their pyramids the same vertices along it, with the same linear depths,
/// wherever both see one surface there, and holds them (DepthTriangulation::Vertex). On such an edge the depths of both
/// cameras are the same number, and so is where along it a point is; what both see at it is the mean of what the
/// pixels on either hand, continued by half a pixel, say. Vertices are put where that profile is farther than
/// `tolerance` (linear depth) from the line between its neighbours. Three sides that meet in a corner agree in it.
/// Sides that share no edge are left as they are. Linear in the pixels along the edges.
void join_seams(std::vector<SideTriangulation>& sides, double tolerance);

/// How many vertices join_seams() would put along the edges.
std::size_t count_seam_vertices(std::vector<SideTriangulation> const& sides, double tolerance);

/// The point of the cube's surface about the origin, in multiples of 1 / 2^24 of half its edge, that the ray through a
/// place of a side's picture meets: equal for the same point of an edge that two sides share.
std::array<long, 3> seam_key(Camera const& camera, Eigen::Matrix3d const& node_from_camera,
                             Eigen::Vector2d const& place);

}  // namespace scanview
