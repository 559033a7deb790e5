#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "acquire/scan_set.h"

namespace scanview {

/// Marks as `cut` the depths whose points lie outside the box (object coordinates; camera coordinates of a view without
/// a pose). Returns how many.
std::size_t cut_box(ScanSet& set, std::array<Eigen::Vector3d, 2> const& box);

/// A plane normal . p = offset; the normal points to where the cameras are.
struct GroundPlane {
  Eigen::Vector3d normal{0, 0, 1};
  double offset = 0;
  double share = 0;  ///< of the sampled depths on it
};

/// The plane that holds the most depths: RANSAC over points of all views that have a pose (of the first view where none
/// has), with our own sampler, so that equal seeds give equal planes; an inlier is within three standard deviations of
/// its depth. Refined by least squares on the inliers. Empty where there are fewer than 3 depths or no plane holds 5 %.
std::optional<GroundPlane> find_ground(ScanSet const& set, std::uint64_t seed);

/// Marks as `cut` every depth on the plane (within four standard deviations) or behind it as the cameras see it, of
/// every view with a pose; where no view has one, each view's own plane is found. Returns how many.
std::size_t cut_ground(ScanSet& set, std::uint64_t seed);

}  // namespace scanview
