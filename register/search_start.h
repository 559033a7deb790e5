#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "register/view_surface.h"

namespace scanview {

/// Poses from the views alone.
struct SearchStart {
  std::vector<Eigen::Isometry3d> object_from_camera;           ///< the first view of the largest part at identity
  std::vector<std::vector<std::size_t>> parts;                 ///< of views that links join, largest first
  std::size_t links = 0;                                       ///< pairs of views that fit and agree
  bool joins(std::vector<SurfacePyramid> const& views) const;  ///< do they join all views that have depths?
};

/// Searches the relative pose of pairs of views (pair_search.h): nearest in order first, then farther ones until every
/// view is joined to the others and has several links, of a few views all pairs. A link whose triangles with other
/// links do not close more often than they do is wrong, and is dropped by name. The firmest links that join all views
/// place them, further links count where they agree, and all are balanced (Ceres, doubting the outliers). Parts that
/// nothing joins stand apart, four radii beside each other.
SearchStart start_from_search(ScanSet const& set, std::vector<SurfacePyramid> const& views, double radius,
                              Context& context);

}  // namespace scanview
