#pragma once
#include <cstddef>
#include <optional>

#include "acquire/range_image.h"

namespace scanview {

/// What is known of the scene without the object.
struct BackgroundModel {
  std::optional<RangeImage> empty;  ///< the empty scene, from the same camera; its colour may be black (unknown)
  bool empty_has_color = false;
  std::optional<Eigen::Vector3d> backdrop;  ///< R, G, B, 0 to 255
  double backdrop_tolerance = 0.06;         ///< distance in chromaticity (r, g)
};

/// Classes `background` in place, and returns how many of these pixels had a depth.
/// A depth that the empty scene has as well (within four standard deviations of both, or behind it) is background,
/// unless its colour differs there; one that is well before it is object, whatever its colour. Where the empty scene
/// does not tell, a pixel of the backdrop's chromaticity is background, and one without depth that looks as in the
/// empty scene.
std::size_t remove_background(RangeImage& image, BackgroundModel const& model);

}  // namespace scanview
