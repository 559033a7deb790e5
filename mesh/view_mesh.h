#pragma once
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "base/html.h"
#include "calib/camera.h"
#include "mesh/mesh_marks.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// The small textured mesh of one view. Vertices are in the view's camera coordinates (mesh.colors is empty); the
/// texture is the view's colour picture, mapped projectively: the homogeneous texture coordinates of a vertex p are
/// (s·w, t·w, 0, w), w its depth (Darsa 1998, appendix), which a renderer takes from `camera` and p.
struct ViewMesh {
  Camera camera;
  TriangleMesh mesh;
  std::vector<float> cos_phi;  ///< a triangle: cosine between its normal and the ray to the source camera (Pulli 1997)
  cv::Mat1b feather;           ///< a pixel of the camera: 0 outside the mesh, rising linearly to 255 with the distance
                               ///< in pixels from its boundary
  /// Throws std::logic_error where the parts do not belong together (counts, indices, sizes).
  void check() const;
};

struct MeshOptions {
  /// units, sigmas: no pixel is farther from the mesh than `tolerance`, in depth. automatic: triangles are added as
  /// long as they lower the squared error, in sigmas, by more than noise alone would; five sigma at most.
  enum class Tolerance { units, sigmas, automatic } tolerance_kind = Tolerance::automatic;
  double tolerance = 3.0;  ///< in units or in multiples of each pixel's sigma
  int max_triangles = 0;   ///< a view, used up where more do not model noise alone; 0: as many as the tolerance needs.
                           ///< Less than the outline needs: the outline wins
  /// How vertices are placed. insertion: the worst pixel becomes one (Garland and Heckbert 1995). probing: a random
  /// place on the Voronoi edge of highest priority (Darsa 1998, §4.2), for depths that are dear to sample. decimation:
  /// the full grid loses edges (Lindstrom and Turk 1998; CGAL), slow: the reference.
  enum class Placement { insertion, probing, decimation } placement = Placement::insertion;
  /// What follows the placement. none: vertices keep their pixels' depths. depths: least squares of all vertices'
  /// depths. joint: also flips, moves in the picture, and joining of vertices that can be spared (joint_fit.h).
  enum class Fit { none, depths, joint } fit = Fit::joint;
  double step_sigmas = 6.0;  ///< a depth jump beyond so many sigma plus what the slope explains is a step edge
  /// Triangles that are seen more grazingly are dropped. Steps have a test of their own, and the weight cos φ lets a
  /// grazing triangle count little: dropping it early would leave holes where no other view looks. 90: none is dropped.
  double max_angle_deg = 87.0;
  int feather_px = 16;       ///< distance from the boundary at which the feather weight is full
  int fill_pixels = 9;       ///< holes in one surface of at most so many pixels without depth are bridged; 0: none
  int min_patch_pixels = 2;  ///< smaller groups of pixels on one surface are not meshed: they count as uncovered
  void validate() const;
};

/// Depth error of a mesh over the pixels of its range image: along the ray, at pixels the mesh covers.
struct MeshFigures {
  std::size_t triangles = 0;
  double rms = 0, p95 = 0, max = 0;  ///< units
  double uncovered = 0;              ///< share of object pixels that no triangle covers
};

struct ViewMeshResult {
  ViewMesh view_mesh;
  MeshFigures figures;
  double tolerance = 0;  ///< used: in units (units), or multiples of sigma
};

/// Meshes one range image. The outline of what has depth and the step edges become polylines between the pixels, within
/// half a pixel of their sides (outline.h, surface_links.h): constraints of a Delaunay triangulation (CGAL), each side
/// with its own vertices, so that no triangle spans a step and a mesh covers exactly the object's pixels and small
/// holes between them. Vertices are placed and fitted inside (depth_approximation.h); the tolerance holds on the single
/// precision vertices. Patches of fewer than min_patch_pixels and grazing triangles are left out: `uncovered` counts
/// their pixels. The normal (b − a) × (c − a) of a triangle points towards the camera. An image with too few depths for
/// a triangle gives an empty mesh. About n log n; one thread. `marks` restrict and cut it by hand (mesh_marks.h).
ViewMeshResult mesh_range_image(RangeImage const& image, MeshOptions const& options, Context& context,
                                MeshMarks const& marks = {});

/// mesh.ply (exact, with `cos` a triangle) and feather.png of one view; reading checks sizes and indices.
void write_view_mesh(std::filesystem::path const& view_folder, ViewMesh const& view_mesh);
ViewMesh read_view_mesh(std::filesystem::path const& view_folder, Camera const& camera);

/// GLB for other programs (DESIGN §3): y up, z backward by a node transform that also holds the unit; triangles and
/// picture are those of textured_mesh().
std::string encode_glb(std::vector<ViewMesh const*> const& meshes, ScanSet const& set,
                       std::vector<std::size_t> const& view_indices);

/// Wireframes over the pictures, counts and errors.
ReportSection mesh_section(ScanSet const& set, std::vector<ViewMeshResult> const& results);

}  // namespace scanview
