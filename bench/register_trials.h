#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"

namespace scanview {

/// One start of one pair of views, in camera coordinates and millimetres; b_from_a * p_a = p_b.
struct RegisterTrial {
  std::string set, a, b;
  double angle_deg = 0, percent = 0;  ///< how far the start is off the truth
  double size = 0;                    ///< of the object
  Eigen::Isometry3d start, truth;
};

/// Range images in millimetres, by set and view.
using TrialViews = std::map<std::string, std::map<std::string, View>>;

/// The bunny and the dragon from `data`, and ten views of the bunny's model by the synthetic scanner.
TrialViews read_trial_views(std::filesystem::path const& data, Context& context);

/// Ten views of the bunny's model, millimetres, sigma 0.1 mm along z, by the seed of the context.
std::map<std::string, View> read_synthetic_views(std::filesystem::path const& data, Context& context);

/// Mean of what a view saw, camera coordinates.
Eigen::Vector3d centroid_of(RangeImage const& image);

/// A pose turned and moved about the middle of what its view saw, by this much in directions of the seed's choice.
Eigen::Isometry3d disturbed(Eigen::Isometry3d const& target_from_camera, RangeImage const& image, double degrees,
                            double length, std::uint64_t seed, std::size_t number);

/// Share of the smaller view's depths that lie within 1 mm of the other's surface.
double shared_share(RangeImage const& a, RangeImage const& b, Eigen::Isometry3d const& b_from_a);

/// Lines `set resolution target source angle_deg translation_percent size_mm T_start(12) T_true(12)`,
/// target_from_source in scan coordinates, row by row. Synthetic views are our own: their start is disturbed likewise,
/// by the seed.
std::vector<RegisterTrial> read_trials(std::filesystem::path const& file, std::filesystem::path const& data,
                                       TrialViews const& views, std::uint64_t seed);

}  // namespace scanview
