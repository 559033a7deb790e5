#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "acquire/range_image.h"
#include "base/files.h"
#include "mesh/surface_links.h"

namespace scanview {

/// What a person drew over a view to correct its mesh, in pixels of its picture.
struct MeshMarks {
  using Polygon = std::vector<Eigen::Vector2d>;
  std::vector<Polygon> keep;    ///< where there are any, only pixels inside one of them are meshed
  std::vector<Polygon> remove;  ///< pixels inside are not meshed
  std::vector<Polygon> cut;     ///< open lines: a step edge, whatever the depths say

  bool empty() const { return keep.empty() && remove.empty() && cut.empty(); }
};

/// {"VIEW": {"keep": [[[u, v], ...], ...], "remove": [...], "cut": [...]}, ...}. Throws Error{bad_input, path} naming
/// the key that is unknown, a polygon with fewer than three corners, a line with fewer than two, or what is no pixel.
std::map<std::string, MeshMarks> mesh_marks_from_json(Json const& json, std::filesystem::path const& path);

/// Takes the depths of pixels away (class `cut`) that keep and remove exclude; a pixel is inside by its centre,
/// even-odd for polygons that cross themselves.
void apply_polygons(MeshMarks const& marks, RangeImage& image);
/// Parts neighbouring pixels whose centres' connection crosses a cut.
void apply_cuts(MeshMarks const& marks, SurfaceLinks& links);

}  // namespace scanview
