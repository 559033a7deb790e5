#pragma once
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"

namespace scanview {

/// What a fixed camera would see without the object, from views between which only the object moved.
struct BackgroundModel {
  cv::Mat1f depth;          ///< in units; NaN where nothing is known
  cv::Mat1f sigma;          ///< of `depth`, larger where it had to be bridged from the surroundings
  cv::Mat3f color;          ///< linear in sRGB values, 0 .. 255, BGR; meaningful where `color_sigma` is finite
  cv::Mat1f color_sigma;    ///< spread of the static colour over the views, of one channel; NaN where never seen
  double noise_factor = 1;  ///< how static depths scatter over the views, relative to their sigma
};

/// Separates the object from what stays the same. The images must have cameras of one size and intrinsics; views that
/// differ are left as they are (and named by a warning). Classes become `background` where the object is not,
/// `no_depth` where it is but has no depth, `outlier` where colour says object but the depth is that of the background.
/// Returns how many depths went. With fewer than three usable views nothing can be said: a warning, and 0.
///   1. static_background: what is behind the object.
///   2. object_mask, a view at a time: how far each depth stands out of the background in standard deviations, and how
///      its colour differs, become log likelihood ratios (depth counts little within a few pixels of a step, where the
///      sensor's matching window straddles it); a graph cut finds the mask with the shortest border along edges.
///   3. Pieces that no depth supports go; depths inside the mask that are still the background's are outliers.
/// Limits: a solid of revolution of one colour that turns about its axis stays the same, and goes; a turntable whose
/// whole surface changes colour is taken for the object, and needs the ground cut. Cost: linear in pixels times views,
/// and a graph cut a view (about 0.2 s for 640x480).
std::size_t remove_static_background(ScanSet& set, Context& context);

/// The model alone, from the given views (at least three). Sure is what three quarters of the views agree on in depth
/// and colour, in pieces of 1 % of the picture and more. From there planes, fitted to the surroundings, carry it on to
/// what fewer views saw, where at least two (a fifth) agree with the prediction and nothing lies behind. What the
/// object always covers is bridged by the smoothest surface, with a sigma that grows with distance. Colours of the
/// views are first brought to one exposure.
BackgroundModel static_background(std::vector<RangeImage const*> const& images);

/// The object in one view: 255 where it is. `image` is not changed.
cv::Mat1b object_mask(RangeImage const& image, BackgroundModel const& model);

}  // namespace scanview
