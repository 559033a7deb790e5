#pragma once
#include <opencv2/core/matx.hpp>
#include <optional>
#include <vector>

#include "mesh/polygon_model.h"

namespace scanview {

/// What a model's materials say of plain colours.
struct MaterialColors {
  std::vector<std::optional<cv::Vec3b>> colors;  ///< of each material, 8-bit sRGB, B G R; none: it says nothing
  std::vector<std::int32_t> of_triangle;         ///< the material of each triangle, -1: none; empty: of no triangle
};

/// The model with the plain colours of its materials at its vertices. Models that have colours of their own, or whose
/// triangles without a texture have no material that states one, are left as they are; elsewhere what nothing is said
/// of is white. A vertex that triangles of several colours share keeps the first one's, and the other triangles are
/// given a texture of one pixel: every triangle shows its own colour, and vertices and triangles stay what they were.
/// Linear time.
PolygonModel colored_by_materials(PolygonModel model, MaterialColors const& materials);

}  // namespace scanview
