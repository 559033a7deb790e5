#pragma once
#include "viewer/visibility/visibility_field.h"

namespace scanview {

/// The patches of a model and how they fuse on. Transparent triangles, if any, make one last patch that never fuses.
PatchHierarchy model_patches(PolygonModel const& model, VisibilityMethod method, std::size_t count);

/// What cameras see of fine patches.
struct SampledRows {
  BitRows bits;  ///< as VisibilityField::rows
  /// Of each node of the hierarchy: the triangles that its patch would make the cameras draw, altogether. Those that
  /// turn their other side are not drawn (VisibilitySelector).
  std::vector<std::uint64_t> cost;
};

/// row_of_camera[i] gets what camera i sees; cameras of one row are OR-ed. center, radius: of the ball around the
/// model.
SampledRows sample_rows(PolygonModel const& model, PatchHierarchy const& hierarchy, VisibilityOptions const& options,
                        Eigen::Vector3d const& center, double radius, std::vector<SampleCamera> const& cameras,
                        std::vector<std::size_t> const& row_of_camera, std::size_t rows, Context& context);

/// A field's ball and hash; its patches are not chosen yet. Throws Error{usage} for a model without extent.
VisibilityField field_of(PolygonModel const& model, VisibilityOptions const& options);

/// Samples, chooses the patches, and fills in rows; the lookup is set already.
void sample_field(PolygonModel const& model, VisibilityOptions options, std::vector<SampleCamera> const& cameras,
                  std::vector<std::size_t> const& row_of_camera, std::size_t rows, VisibilityField& field,
                  Context& context, VisibilityTimes* times);

/// Coarser patches: begins[k] is the first fine patch of patch k, and the end.
Patches coarser_patches(Patches fine, std::vector<std::uint32_t> const& begins);

/// The rows of coarser patches.
BitRows fuse_columns(BitRows const& bits, std::vector<std::uint32_t> const& begins);

}  // namespace scanview
