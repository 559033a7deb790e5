#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "acquire/captured_node.h"
#include "base/context.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// A node of a walkthrough (Darsa, Costa, Varshney 1998): what is seen from one point, as textured triangles. Vertices
/// are in node coordinates: the scene's axes, the node's position at the origin.
struct NodeMesh {
  /// A part of the triangles and the picture that is projected onto them from the origin.
  struct Side {
    Camera camera;
    Eigen::Matrix3d node_from_camera = Eigen::Matrix3d::Identity();
    Eigen::Vector3d gain{1, 1, 1};  ///< View::gain
    cv::Mat3b color;                ///< where no triangle is, the nearest colour of one
    cv::Mat1b feather;              ///< ViewMesh::feather
    std::size_t first_pane = 0, end_pane = 0;
    std::size_t first = 0, end = 0;  ///< triangles
  };
  Eigen::Vector3d position{0, 0, 0};  ///< in the scene
  std::vector<Side> sides;
  std::vector<Eigen::Vector3f> vertices;   ///< on an edge that two sides share, of both
  std::vector<Eigen::Vector3i> triangles;  ///< side after side; (b − a) × (c − a) points towards the node
  std::vector<float> quality;              ///< a triangle: |N · R| (§4.4), 0 to 1
  /// Windows: where from elsewhere the sky is seen that from here something hides. Drawn where nothing else is, with
  /// the colours that the sky has from here; side after side.
  TriangleMesh panes;
  double parallax_px = 0;  ///< the greatest error, NodeMeshOptions::parallax_px, that was left anywhere

  /// The quality of every vertex: the mean of its triangles', by their angles there, so that it is smooth (§6.2).
  std::vector<float> smooth_quality() const;
  /// Throws std::logic_error where counts and indices do not fit each other.
  void check() const;
};

struct NodeMeshOptions {
  /// A node, all sides together, 0: no limit. Used up only as long as errors are greater than `parallax_px`. Less than
  /// the silhouettes need: the silhouettes win.
  int max_triangles = 15000;
  /// No pixel is off by more when the eye walks `walking_radius` from the node: |Δ(1/z)| · focal length · radius, in
  /// pixels of the side (of the same angle elsewhere), or by three sigma of its depth where that is more.
  double parallax_px = 0.25;
  double walking_radius = 1;  ///< scene units
  /// MeshOptions::Placement without the grid.
  enum class Placement { insertion, probing } placement = Placement::insertion;
  /// constrained: depth steps are edges of the triangulation. torn, skins: the paper's; triangles cross them, and those
  /// that do are left out, or stay as skins in which colours are interpolated across the gap (figure 15).
  enum class Silhouettes { constrained, torn, skins } silhouettes = Silhouettes::constrained;
  enum class Fit { none, depths, joint } fit = Fit::joint;  ///< MeshOptions::Fit
  double step_sigmas = 6;                                   ///< MeshOptions::step_sigmas
  int min_patch_pixels = 1;                                 ///< MeshOptions::min_patch_pixels
  int fill_pixels = 0;                                      ///< MeshOptions::fill_pixels
  int feather_px = 16;                                      ///< MeshOptions::feather_px
  /// far: where nothing is nearer, the sky is drawn, a hundred times as far away as the farthest depth, and at least as
  /// far that walking moves it by less than a hundredth of a pixel, and has panes. gap: nothing is there.
  enum class Background { far, gap } background = Background::far;
  void validate() const;
};

/// Simplifies a node in image space (§4). Sides whose pictures share an edge, as those of a cube do, are triangulated
/// together: along it both have the same vertices with the same depths wherever both see one surface, so that no eye
/// finds a crack (the paper's own remark in §8). Triangles go where the error in pixels of parallax is greatest,
/// whatever the side. About n log n in the pixels; sides in parallel.
NodeMesh mesh_node(CapturedNode const& node, NodeMeshOptions const& options, Context& context);

}  // namespace scanview
