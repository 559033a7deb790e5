#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "acquire/depth_noise.h"
#include "acquire/import.h"

namespace scanview {

/// One view as an importer reads it: ideal camera, depth with NaN for missing, and perhaps an object mask.
struct RawView {
  Camera camera;
  cv::Mat1f depth;
  cv::Mat3b color;  ///< empty: shaded by normal once noise is known
  cv::Mat1b mask;   ///< 0: not the object; empty: no mask
  std::optional<Eigen::Isometry3d> object_from_camera;
};

/// Where a view comes from. `load` may run in parallel with others; what it throws (bad_input, io) fails this view
/// only.
struct ViewSource {
  std::string name;
  std::function<RawView()> load;
};

/// What all kinds of import share: how the set was measured.
struct BuildPlan {
  std::filesystem::path path;  ///< named where nothing can be imported
  Unit unit = Unit::m;
  bool fixed_camera = false;
  /// The noise model, given the median depth of all views; its scale is then estimated.
  std::function<DepthNoise(double typical_depth)> noise;
  std::vector<ViewSource> views;
};

/// Loads the views (every options.step-th), drops depths out of range, gives sigma, removes outliers, static
/// background, what is outside the box and below the ground, and fills centre and error budget. Views that fail are
/// named with a warning; Error{bad_input} naming the first cause where none is left. files_read stays empty.
ImportResult build_import(BuildPlan const& plan, ImportOptions const& options, Context& context);

/// Gray of a Lambertian surface lit from the camera; black where there is no normal.
cv::Mat3b shade_by_normal(RangeImage const& image);
/// Whether the colour is what shade_by_normal draws: it moves with the camera, and belongs to no point of the surface.
bool is_drawn_shading(RangeImage const& image);

/// A view name made of what is allowed in one (letters, digits, '_', '-', '.'); other characters become '_', a leading
/// '.' too; empty becomes "view".
std::string safe_view_name(std::string const& text);

/// `names` made safe and distinct: doubles get "_2", "_3" ... in order.
std::vector<std::string> safe_view_names(std::vector<std::string> const& names);

}  // namespace scanview
