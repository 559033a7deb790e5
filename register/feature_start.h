#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "register/view_surface.h"

namespace scanview {

/// Poses from matched colour features alone, for views that nothing is known about.
struct FeatureStart {
  std::vector<Eigen::Isometry3d> object_from_camera;           ///< the first view of every part at identity
  std::vector<std::vector<std::size_t>> parts;                 ///< of views that features join, largest first
  bool joins(std::vector<SurfacePyramid> const& views) const;  ///< do they join all views that have depths?
};

/// Matches every view with every other, not only with its neighbours: the same side is seen by several views, and one
/// weak link must not decide. The strongest links (inlying features) that join all views place them; a further link
/// counts only where it agrees with these, so that the same print in two places does no harm; and all that are left are
/// balanced (Ceres, doubting the outliers). Cost: squares of the views and of their features.
FeatureStart start_from_features(ScanSet const& set, std::vector<SurfacePyramid> const& views, double radius,
                                 Context& context);

}  // namespace scanview
