#include "bench/mesh_peers.h"

#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Bounded_normal_change_placement.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/GarlandHeckbert_policies.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <stdexcept>

#ifdef SCANVIEW_WITH_MESHOPTIMIZER
#include <meshoptimizer.h>
#endif

namespace scanview {
namespace {

namespace simplification = CGAL::Surface_mesh_simplification;
using Kernel = CGAL::Simple_cartesian<double>;
using Surface = CGAL::Surface_mesh<Kernel::Point_3>;

Surface to_surface(TriangleMesh const& mesh) {
  Surface surface;
  for (Eigen::Vector3f const& v : mesh.vertices) surface.add_vertex({v.x(), v.y(), v.z()});
  for (Eigen::Vector3i const& t : mesh.triangles)
    surface.add_face(Surface::Vertex_index(Surface::size_type(t[0])), Surface::Vertex_index(Surface::size_type(t[1])),
                     Surface::Vertex_index(Surface::size_type(t[2])));
  return surface;
}

TriangleMesh from_surface(Surface& surface) {
  surface.collect_garbage();
  TriangleMesh mesh;
  for (auto const v : surface.vertices()) {
    auto const& p = surface.point(v);
    mesh.vertices.emplace_back(float(p.x()), float(p.y()), float(p.z()));
  }
  for (auto const face : surface.faces()) {
    Eigen::Vector3i corners;
    int i = 0;
    for (auto const v : CGAL::vertices_around_face(surface.halfedge(face), surface)) corners[i++] = int(v);
    mesh.triangles.push_back(corners);
  }
  return mesh;
}

/// Ends a collapse at a number of faces.
struct FaceCount {
  std::size_t faces;
  template <typename Cost, typename Profile>
  bool operator()(Cost const&, Profile const& profile, std::size_t, std::size_t) const {
    return profile.surface_mesh().number_of_faces() <= faces;
  }
};

TriangleMesh simplify_with_meshoptimizer(TriangleMesh const& mesh, int triangles) {
#ifdef SCANVIEW_WITH_MESHOPTIMIZER
  std::size_t const indices = 3 * mesh.triangles.size();
  std::vector<unsigned> result(indices);
  auto const* const from = reinterpret_cast<unsigned const*>(mesh.triangles.data());
  constexpr float kAnyError = 1e6f;
  result.resize(meshopt_simplify(result.data(), from, indices, mesh.vertices.front().data(), mesh.vertices.size(),
                                 sizeof(Eigen::Vector3f), 3 * std::size_t(triangles), kAnyError, 0, nullptr));
  TriangleMesh simplified;
  simplified.vertices = mesh.vertices;
  for (std::size_t i = 0; i < result.size(); i += 3)
    simplified.triangles.emplace_back(int(result[i]), int(result[i + 1]), int(result[i + 2]));
  return simplified;
#else
  (void)mesh, (void)triangles;
  throw std::runtime_error("meshoptimizer is not installed (Debian: libmeshoptimizer-dev)");
#endif
}

}  // namespace

TriangleMesh full_grid(RangeImage const& image) {
  TriangleMesh mesh;
  int const width = image.camera.width(), height = image.camera.height();
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) mesh.vertices.push_back(image.point(x, y).cast<float>());
  for (int y = 0; y + 1 < height; ++y)
    for (int x = 0; x + 1 < width; ++x) {
      int const a = y * width + x;
      mesh.triangles.emplace_back(a, a + width, a + 1);
      mesh.triangles.emplace_back(a + 1, a + width, a + width + 1);
    }
  return mesh;
}

TriangleMesh simplify_with_peer(MeshPeer peer, TriangleMesh const& mesh, int triangles) {
  if (peer == MeshPeer::meshoptimizer) return simplify_with_meshoptimizer(mesh, triangles);
  Surface surface = to_surface(mesh);
  FaceCount const stop{std::size_t(triangles)};
  if (peer == MeshPeer::lindstrom_turk) {
    simplification::edge_collapse(surface, stop);  // its defaults
  } else {
    // As CGAL's own example has it.
    using Policies = simplification::GarlandHeckbert_plane_policies<Surface, Kernel>;
    Policies const policies(surface);
    simplification::Bounded_normal_change_placement<Policies::Get_placement> const placement(policies.get_placement());
    simplification::edge_collapse(surface, stop,
                                  CGAL::parameters::get_cost(policies.get_cost()).get_placement(placement));
  }
  return from_surface(surface);
}

}  // namespace scanview
