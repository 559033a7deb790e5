#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <optional>
#include <vector>

#include "mesh/triangle_mesh.h"
#include "synth/centered_model.h"
#include "synth/ray_scene.h"

namespace scanview {

/// Whether the triangles of a scene say which side of them is outside.
enum class SceneWinding {
  trusted,  ///< counter-clockwise seen from outside: a place that sees mostly backs is inside an object
  ignored,  ///< either side is a surface, and no place is inside of anything
};

/// When a picture taken at a node shows a point well enough for an eye that sees it, too: nothing is between, and the
/// node samples the surface about as finely. A pixel of a node covers an area that grows with d^2 / cos, d the distance
/// and cos that of the angle to the surface's normal; sqrt of it is compared.
struct SightRules {
  double least_cosine = 0.1;       ///< of the angle to the normal; less is enough where the eye has no more itself
  double greatest_coarseness = 4;  ///< the node's d / sqrt(cos) as a multiple of the eye's
  double sharp_from = 0;           ///< scene units: an eye nearer than this to a surface counts as this far from it
  /// Throws Error{usage} naming the field and its range.
  void validate() const;
};

/// A point of a surface that an eye sees along one direction, in the coordinates of a SceneSight.
struct SeenPoint {
  Eigen::Vector3f position{0, 0, 0};  ///< lifted off the surface by a few bits
  Eigen::Vector3f normal{0, 0, 0};    ///< towards the eye; zero where nothing is seen, or a back
  float least_cosine = 0;             ///< a node that sees it has no less,
  float greatest_pitch = 0;           ///< and its d / sqrt(cos) is no more
  bool is_there() const { return !normal.isZero(0); }
};

/// A scene to look around in, by rays. Positions that go in are the scene's. Every length inside is relative to the
/// scene's size, so that scenes of any scale and place work. All members may be called from several threads.
class SceneSight {
 public:
  /// Throws Error{bad_input} for a model without triangles or without extent.
  SceneSight(TriangleMesh const& scene, SceneWinding winding);
  double radius() const { return model_.radius; }  ///< of a sphere that holds the scene
  Eigen::AlignedBox3d box() const;                 ///< of all triangles, scene coordinates
  /// To the nearest surface; `farthest` where that is farther.
  double distance(Eigen::Vector3d const& place, double farthest) const;
  /// Whether more of 256 even directions meet backs than fronts first. Never with SceneWinding::ignored.
  bool is_inside_object(Eigen::Vector3d const& place) const;
  /// What is seen along `directions` even ones (a Fibonacci spiral, turned at random by seed and item), each with the
  /// same solid angle.
  std::vector<SeenPoint> look_around(Eigen::Vector3d const& eye, int directions, SightRules const& rules,
                                     std::uint64_t seed, std::uint64_t item) const;
  /// A bit for each point, 64 a word: whether it is there and `node` sees it by the rules it carries.
  std::vector<std::uint64_t> sees(Eigen::Vector3d const& node, std::vector<SeenPoint> const& points) const;
  /// The first surface along a ray (direction: any length, scene units a step); nothing within the scene: no value.
  struct Surface {
    double distance;         ///< in lengths of `direction`
    bool is_front, is_back;  ///< both with SceneWinding::ignored
  };
  std::optional<Surface> first_surface(Eigen::Vector3d const& origin, Eigen::Vector3d const& direction) const;

 private:
  Eigen::Vector3f local(Eigen::Vector3d const& place) const { return (place - model_.center).cast<float>(); }
  Eigen::Vector3f normal(int triangle) const;
  CenteredModel model_;
  std::vector<Eigen::Vector3i> triangles_;
  SceneWinding winding_;
  RayScene rays_;
};

/// The share of all directions from the eye in which a surface is seen there and from none of the nodes: the gaps of a
/// picture of everything around, were it made from the nodes' pictures. Cost: `directions` rays and as many a node.
double uncovered_share(SceneSight const& scene, std::vector<Eigen::Vector3d> const& nodes, Eigen::Vector3d const& eye,
                       int directions, SightRules const& rules = {}, std::uint64_t seed = 1);

}  // namespace scanview
