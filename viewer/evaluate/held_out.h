#pragma once
#include <string>
#include <vector>

#include "base/context.h"
#include "base/html.h"
#include "viewer/renderer.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {

/// A view's photograph against what a renderer draws from the view's camera. Object pixels are those with a depth.
struct ViewFigures {
  std::size_t view = 0;  ///< index in the set
  std::string name;
  double psnr_common = 0;   ///< dB, over object pixels that the renderer drew
  double psnr_all = 0;      ///< dB, over all object pixels; what was not drawn counts as black
  double ssim = 0;          ///< over all object pixels, likewise
  double coverage = 0;      ///< share of object pixels that the renderer drew
  double milliseconds = 0;  ///< of one frame
  cv::Mat3b photograph;     ///< with the view's gain, black outside the object
  cv::Mat3b rendered;       ///< black where nothing was drawn
  cv::Mat3b difference;     ///< of the two inside the object, four times enlarged
};

/// Draws from the camera of a view, which must have a pose, and compares.
ViewFigures compare_with_photograph(Renderer& renderer, ScanSet const& set, std::size_t view);

/// Each of `views` rendered from all others (and without what options.excluded names).
std::vector<ViewFigures> evaluate_held_out(GlContext& gl, ScanSet const& set, std::vector<ViewMesh> const& meshes,
                                           std::vector<std::size_t> const& views, ViewBasedOptions const& options,
                                           Context& context);

/// Each of `views` rendered with all views in use: how faithfully a photograph comes back from its own camera.
std::vector<ViewFigures> evaluate_source_views(GlContext& gl, ScanSet const& set, std::vector<ViewMesh> const& meshes,
                                               std::vector<std::size_t> const& views, ViewBasedOptions const& options,
                                               Context& context);

/// Held-out views beside their photographs, and the figures of both kinds.
ReportSection evaluate_section(std::vector<ViewFigures> const& held_out, std::vector<ViewFigures> const& source);

}  // namespace scanview
