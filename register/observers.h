#pragma once
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "acquire/scan_set.h"
#include "register/view_surface.h"

namespace scanview {

/// How many other views see each depth of one view, on a square grid of pixels over the part that has depths.
struct Observers {
  std::size_t view = 0;
  cv::Mat1s counts;  ///< views; -1 where the view itself has no depth, or an outline, which others cannot match
  double seen = 0;   ///< share of the depths that one other view sees, or more; 0 without depths
};

/// Projects the depths of `view`, about `pixels` of them, into all other views; "sees" is what distance_to_surface
/// finds within `gate` (units). `surfaces` are pyramids of the set's views, of which the finest level is looked at.
/// Cost: pixels times views.
Observers count_observers(ScanSet const& set, std::vector<SurfacePyramid> const& surfaces,
                          std::vector<Eigen::Isometry3d> const& object_from_camera, std::size_t view, double gate,
                          std::size_t pixels);

}  // namespace scanview
