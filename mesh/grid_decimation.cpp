#include "mesh/grid_decimation.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_cost.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/LindstromTurk_placement.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <boost/optional.hpp>
#include <vector>

#include "mesh/surface_links.h"

namespace scanview {
namespace {

namespace simplification = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Point = Kernel::Point_3;
using Surface = CGAL::Surface_mesh<Point>;

/// Where an edge may collapse to, if at all.
class Placement {
 public:
  Placement(DepthField const& field, Camera const& camera, double limit)
      : field_(&field), camera_(&camera), limit_(limit) {}

  template <typename Profile>
  boost::optional<Point> operator()(Profile const& profile) const {
    Surface const& surface = profile.surface_mesh();
    bool const first = is_on_border(profile.v0(), surface), second = is_on_border(profile.v1(), surface);
    if (first && second) return boost::none;  // the border stays
    boost::optional<Point> const target = first    ? profile.p0()
                                          : second ? profile.p1()
                                                   : simplification::LindstromTurk_placement<Surface>()(profile);
    if (!target || (camera_->is_perspective() && !(target->z() > 0))) return boost::none;
    for (auto const& triangle : profile.triangles()) {
      Surface::Vertex_index const corners[3] = {triangle.v0, triangle.v1, triangle.v2};
      DepthTriangle shape;
      int moving = 0;
      for (int i = 0; i < 3; ++i) {
        bool const moves = corners[i] == profile.v0() || corners[i] == profile.v1();
        moving += moves;
        Point const& p = moves ? *target : surface.point(corners[i]);
        shape.corner[i] = camera_->project({p.x(), p.y(), p.z()});
        shape.depth[i] = linear_depth(*camera_, p.z());
      }
      constexpr double kLeastTurn = 1e-6;  // square pixels
      if (moving == 1 && (!(shape.turn() > kLeastTurn) || scan_error(*field_, shape).worst > limit_))
        return boost::none;
    }
    return target;
  }

 private:
  static bool is_on_border(Surface::Vertex_index v, Surface const& surface) {
    return bool(CGAL::is_border(v, surface));
  }

  DepthField const* field_;
  Camera const* camera_;
  double limit_;
};

Surface to_surface(DepthTriangulation const& triangulation, Camera const& camera) {
  Surface surface;
  for (auto const& v : triangulation.vertices()) {
    Eigen::Vector3d const p = camera.unproject(v.position.x(), v.position.y(), linear_depth(camera, v.depth));
    surface.add_vertex({p.x(), p.y(), p.z()});
  }
  for (auto const& t : triangulation.triangles()) {
    auto const corner = [&](int i) { return Surface::Vertex_index(Surface::size_type(t.vertex[i])); };
    surface.add_face(corner(0), corner(1), corner(2));
  }
  return surface;
}

DepthTriangulation to_triangulation(Surface const& surface, Camera const& camera) {
  DepthTriangulation result;
  std::vector<int> index(surface.num_vertices(), -1);
  for (auto const v : surface.vertices()) {
    Point const& p = surface.point(v);
    index[std::size_t(v)] = result.add_vertex(camera.project({p.x(), p.y(), p.z()}), linear_depth(camera, p.z()),
                                              bool(CGAL::is_border(v, surface)));
  }
  for (auto const face : surface.faces()) {
    int corners[3], i = 0;
    for (auto const v : CGAL::vertices_around_face(surface.halfedge(face), surface))
      corners[i++] = index[std::size_t(v)];
    result.add_triangle(corners[0], corners[1], corners[2]);
  }
  result.connect();
  return result;
}

}  // namespace

DepthTriangulation decimate_grid(DepthTriangulation const& grid, DepthField const& field, Camera const& camera,
                                 double limit, int max_triangles) {
  Surface surface = to_surface(grid, camera);
  std::size_t border = 0;
  for (auto const edge : surface.edges()) border += surface.is_border(edge);
  // Of t triangles with b edges of the border there are (3 t + b) / 2 edges.
  simplification::Count_stop_predicate<Surface> const stop((3 * std::size_t(max_triangles) + border) / 2 + 1);
  simplification::edge_collapse(surface, stop,
                                CGAL::parameters::get_cost(simplification::LindstromTurk_cost<Surface>())
                                    .get_placement(Placement(field, camera, limit)));
  surface.collect_garbage();
  return to_triangulation(surface, camera);
}

}  // namespace scanview
