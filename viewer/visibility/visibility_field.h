#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "base/context.h"
#include "mesh/polygon_model.h"
#include "viewer/visibility/bit_rows.h"
#include "viewer/visibility/patch_tree.h"
#include "viewer/visibility/sample_sphere.h"
#include "viewer/visibility/triangle_sampler.h"

namespace scanview {

/// `id`: a bit a polygon (Meruvia 2001); `patch`: a bit a patch of polygons (Meruvia 2002).
enum class VisibilityMethod { id, patch };

/// Where the tree of patches is cut: `even`, as it grew, smallest first (Meruvia 2002); `adaptive`: where samples say
/// that least is drawn in vain (choose_patches()): small patches where visibility changes, large ones inside.
enum class PatchCut { even, adaptive };

/// Eyes anywhere around the model: samples on shells of directions. A row for each shell's each direction.
struct SphereLookup {
  SampleSphere sphere = SampleSphere::octahedron(0);
  /// Distances from the centre in radii, ascending; infinity: orthographic. Eyes nearer than the first see everything;
  /// of those farther than the last its samples decide alone.
  std::vector<double> shells;
  /// OR the three samples around the eye, or also the three opposite to their edges (Meruvia 2001, section 3.2.1).
  bool opposite = false;
  /// A row for each face between each two shells instead (conservative mode).
  bool rows_are_cells = false;
};
/// A recorded path: a row for each stretch of it.
struct PathLookup {
  std::vector<Eigen::Vector3d> eyes;  ///< of the frames
  std::size_t stretch = 1;            ///< frames a row
};
/// A grid of cells inside a box: a row for each, x fastest. An eye sees what its cell and its neighbours see.
struct GridLookup {
  Eigen::AlignedBox3d box;
  Eigen::Vector3i cells = {1, 1, 1};
};

/// Which patches of a model an eye can see.
struct VisibilityField {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();  ///< of the ball around the model
  double radius = 0;
  Patches patches;  ///< triangles in the order in which they are drawn
  BitRows rows;     ///< columns 2 p and 2 p + 1: whether the fronts and the backs of patch p's triangles are seen
  std::variant<SphereLookup, PathLookup, GridLookup> lookup;
  std::string model_hash;  ///< of the model it was made for (model_hash())
  VisibilityMethod method = VisibilityMethod::patch;
  std::size_t fine_patches_asked = 0;      ///< model_patches() of so many ...
  std::vector<std::uint32_t> fine_begins;  ///< ... of which each patch begins with this one; and the end

  /// The rows to OR for an eye; none: everything is drawn. At most 64 of them.
  struct Query {
    std::size_t rows[64];
    std::size_t count = 0;
    int tests = 0;         ///< to find the face (SampleSphere::Location)
    std::size_t cell = 0;  ///< equal cells have equal rows
  };
  Query query(Eigen::Vector3d const& eye) const;
};

struct VisibilityOptions {
  VisibilityMethod method = VisibilityMethod::patch;
  std::size_t samples = 1026;  ///< directions: 6, 18, 66, 258, 1026, 4098
  /// A person's cameras instead; their directions make the sphere, their own distances the near shell.
  std::vector<SampleCamera> cameras;
  std::size_t patches = 0;  ///< 0: one for every 64 polygons
  PatchCut cut = PatchCut::adaptive;
  /// Distances of the samples in radii of the model, ascending; infinity: orthographic.
  std::vector<double> shells = default_shells();
  int resolution = 512;  ///< of a sample's picture
  /// Triangles count as seen that an eye off the sample would see (TriangleSampler), as far off as this share of half
  /// the distance to the next sample. 0 leaves only the smaller than a pixel.
  double widening = 0.15;
  Seen seen = Seen::nearly;  ///< in the papers: in_picture
  /// After each sample, neighbours of seen polygons that face the camera count as seen too, so many times (Meruvia
  /// 2001, section 3.1.1); −1: as long as there are any.
  int fill = 0;
  bool opposite = false;  ///< SphereLookup; always with `id`

  /// A patch is drawn unless it is proven hidden from all eyes between samples (find_hidden_cells()), instead of where
  /// samples saw it: no pixel is missed, and less is left out. Octahedron only.
  bool conservative = false;

  static std::vector<double> default_shells();
  /// Throws Error{usage} that names the field.
  void validate() const;
};

/// How the time went, in seconds.
struct VisibilityTimes {
  double patches = 0, sampling = 0;
  std::size_t pictures = 0;
};

/// Samples a model. Transparent polygons hide nothing and belong to one last patch that is always seen. Warns where
/// cameras leave directions uncovered. Throws Error{usage} for bad options and for a model without extent.
VisibilityField build_visibility(PolygonModel const& model, VisibilityOptions const& options, Context& context,
                                 VisibilityTimes* times = nullptr);

/// For a recorded path: a row for each `stretch` frames, of what their cameras show (PathLookup).
VisibilityField build_path_visibility(PolygonModel const& model, std::vector<SampleCamera> cameras, std::size_t stretch,
                                      VisibilityOptions const& options, Context& context,
                                      VisibilityTimes* times = nullptr);

/// For eyes inside the model: cells of a grid, each with six pictures from its middle, widened to the whole cell; an
/// eye sees what its cell and those around see (GridLookup; Meruvia 2001, section 5: navigation viewer).
VisibilityField build_grid_visibility(PolygonModel const& model, Eigen::AlignedBox3d const& box,
                                      Eigen::Vector3i const& cells, VisibilityOptions const& options, Context& context,
                                      VisibilityTimes* times = nullptr);

/// Only the ball around a model: center and radius. Throws Error{usage} for a model without extent.
VisibilityField field_ball(PolygonModel const& model);

/// Identifies positions and triangles of a model.
std::string model_hash(TriangleMesh const& mesh);

/// The model's triangles in the order of the field.
TriangleMesh drawn_mesh(TriangleMesh const& mesh, Patches const& patches);

}  // namespace scanview
