#pragma once
#include <Eigen/Geometry>
#include <functional>
#include <vector>

#include "acquire/captured_node.h"
#include "base/context.h"
#include "base/random.h"
#include "mesh/node_mesh.h"
#include "viewer/scene.h"
#include "viewer/walkthrough/walkthrough_renderer.h"

// Rooms with exact truth, and nodes captured in them.

namespace scanview::test {

/// Linear light, R G B, of a point.
using Paint = std::function<Eigen::Vector3d(Eigen::Vector3d const&)>;
Paint plain(Eigen::Vector3d const& color);
/// By direction from the origin alone: 0.5 + 0.3 sin(`waves` d), between 0.2 and 0.8. Its second derivative by a step
/// of 1 / f of a picture's plane is at most 0.3 (waves² + waves), as |d'| and |d''| are at most 1 there.
Paint by_direction(double waves);

/// The inside of n · p < offset for all planes, n of length 1.
struct Wall {
  Eigen::Vector3d normal;
  double offset;
};
Surface inside_of(std::vector<Wall> const& walls, Paint const& paint);
std::vector<Wall> box_walls(Eigen::Vector3d const& low, Eigen::Vector3d const& high);
/// Ten walls, none of them along an axis.
std::vector<Wall> slanted_walls();
Surface room(double half, Paint const& paint);
Surface globe(Eigen::Vector3d const& center, double radius, Paint const& paint);  ///< a sphere seen from inside
Surface solid_box(Eigen::Vector3d const& low, Eigen::Vector3d const& high, Paint const& paint);

/// What a ray tracer gives: sigma a millionth of the depth. Where nothing is met, background with the sky's colour.
CapturedNode capture_cube(Surface const& surface, Eigen::Vector3d const& position, int size,
                          Paint const& sky = plain({0.2, 0.4, 0.8}));
View node_side(Surface const& surface, Camera const& camera, Eigen::Isometry3d const& scene_from_camera,
               Paint const& sky = plain({0.2, 0.4, 0.8}));
NodeMesh mesh_of(CapturedNode const& node, NodeMeshOptions const& options = {});

WalkthroughRenderer renderer_of(std::vector<NodeMesh> const& nodes, double walking_radius,
                                WalkthroughOptions const& options = {}, NodeQuality quality = NodeQuality::density);
/// An even direction; a camera at `eye` that looks there, rolled at random.
Eigen::Vector3d random_direction(CounterRandom& random);
Eigen::Isometry3d random_look(Eigen::Vector3d const& eye, CounterRandom& random);
/// Which triangle of a node's a ray meets first, and the weights of its corners there; by brute force.
struct TriangleHit {
  std::size_t triangle = 0;
  Eigen::Vector3d weights{0, 0, 0};
  double t = 0;
};
std::optional<TriangleHit> meet(NodeMesh const& mesh, Eigen::Vector3d const& origin, Eigen::Vector3d const& direction);
Camera square_camera(int size, double focal);
std::size_t gaps(Frame const& frame);
/// z in the camera of what a pixel's ray meets; 0: nothing.
double true_depth(Surface const& surface, Camera const& camera, Eigen::Isometry3d const& pose, int x, int y);

}  // namespace scanview::test
