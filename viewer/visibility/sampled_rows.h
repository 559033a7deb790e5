#pragma once
#include "viewer/visibility/visibility_field.h"

namespace scanview {

/// The patches of a model as a field has them: transparent triangles, if any, in one last patch.
Patches model_patches(PolygonModel const& model, VisibilityMethod method, std::size_t count);

/// Fills the field's rows and sides: row_of_camera[i] gets what camera i sees. Cameras of one row are OR-ed.
void sample_rows(PolygonModel const& model, VisibilityOptions const& options, std::vector<SampleCamera> const& cameras,
                 std::vector<std::size_t> const& row_of_camera, std::size_t rows, VisibilityField& field,
                 Context& context);

}  // namespace scanview
