#pragma once
// The drawings in the report of a registration.
#include <Eigen/Geometry>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "register/alignment.h"
#include "register/observers.h"

namespace scanview {

/// Names short enough to stand beside a dot: what all have in common at the front is left out, and of what is left the
/// last eight letters stay.
std::vector<std::string> short_names(ScanSet const& set);

/// What a slab through the object's middle holds at two sets of poses, a colour a view; both pictures show the same
/// part. The slab lies across the direction in which the cameras spread least, so that of a turntable it is level.
struct CrossSections {
  cv::Mat3b before, after;
  double width = 0;  ///< of the part shown, units
};
CrossSections draw_cross_sections(ScanSet const& set, std::vector<Eigen::Isometry3d> const& before,
                                  std::vector<Eigen::Isometry3d> const& after, double slab);

/// The views on a circle, overlapping pairs joined by a line: thicker is more overlap; green where the median distance
/// is `usual` (units) or less, red where it is three times that or the pair is suspicious. Of very many pairs the
/// strongest of each view, and those that are red.
cv::Mat3b draw_overlap_graph(ScanSet const& set, Alignment const& alignment, double usual);

/// A cell a pair, rows and columns in the views' order, same colours.
cv::Mat3b draw_pair_matrix(Alignment const& alignment, std::size_t views, double usual);

/// One view: each depth in the colour of how many other views see it (1 to `most`), gray where it does not count.
cv::Mat3b draw_observers(Observers const& observers, int most);
/// The colour of a count of 0 to `most` there.
cv::Vec3b observer_color(int count, int most);

}  // namespace scanview
