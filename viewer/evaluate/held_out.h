#pragma once
#include <string>
#include <vector>

#include "base/context.h"
#include "base/html.h"
#include "viewer/evaluate/contender.h"

namespace scanview {

/// A view's photograph against what a renderer draws from the view's camera. Object pixels are those with a depth.
struct ViewFigures {
  std::size_t view = 0;  ///< index in the set
  std::string name;
  double psnr_common = 0;   ///< dB, over object pixels that the renderer drew (and, of a contender, ours drew too)
  double ssim_common = 0;   ///< over the same pixels
  double psnr_all = 0;      ///< dB, over all object pixels; what was not drawn counts as black
  double ssim = 0;          ///< over all object pixels, likewise
  double coverage = 0;      ///< share of object pixels that the renderer drew
  double outside = 0;       ///< pixels drawn on the background, as a share of the object's
  double milliseconds = 0;  ///< of one frame
  double psnr_lead = 0;     ///< of a contender: ours is better by so many dB over the common pixels
  double ssim_lead = 0;
  cv::Mat1b object, drawn;  ///< 255 where the object is, where the renderer drew
  cv::Mat3b photograph;     ///< with the view's gain, black outside the object
  cv::Mat3b rendered;       ///< black where nothing was drawn
  cv::Mat3b difference;     ///< of the two inside the object, four times enlarged
};

/// A view's photograph in the set's common exposure, which is what is rendered.
cv::Mat3b exposed_photograph(View const& view);

/// Draws from the camera of a view, which must have a pose, and compares.
ViewFigures compare_with_photograph(Renderer& renderer, ScanSet const& set, std::size_t view);

/// A mean over views with its 95 % confidence interval (Student's t of the paired differences); one view has no
/// interval: all three are its value.
struct Interval {
  double mean = 0, low = 0, high = 0;
};
Interval confidence_interval(std::vector<double> const& values);

struct ContenderFigures {
  std::string name, title;
  std::vector<ViewFigures> views;
  Interval psnr_lead, ssim_lead;  ///< of ours over this one, over common pixels; 0 for ours
};

/// each: every one of the views is drawn from all others; together: none of them is used for any (a list of test
/// views).
enum class HoldOut { each, together };

/// What all contenders draw of the views without having seen them, on the same pixels; ours first. Borders are
/// supersampled for everybody, since a photograph's pixels there are mixtures.
std::vector<ContenderFigures> evaluate_held_out(std::vector<Contender>& contenders, ScanSet const& set,
                                                std::vector<std::size_t> const& views, HoldOut how, Context& context);

/// Each of `views` rendered with all views in use: how faithfully a photograph comes back from its own camera. The
/// set's gains count in both.
std::vector<ViewFigures> evaluate_source_views(std::shared_ptr<ViewLibrary> library, ScanSet const& set,
                                               std::vector<std::size_t> const& views, ViewBasedOptions const& options,
                                               Context& context);

/// Held-out views beside their photographs, and the figures of both kinds.
ReportSection evaluate_section(std::vector<ContenderFigures> const& held_out, std::vector<ViewFigures> const& source);

}  // namespace scanview
