#pragma once
#include <algorithm>
#include <vector>

#include "register/feature_match.h"
#include "register/pair_form.h"

namespace scanview {

/// How well a pose lets two range images explain each other, by projecting samples of each into the other. What a
/// camera saw is surface, and what lies before it is empty: a pose that puts one view's surface there is wrong.
struct PoseCheck {
  std::size_t matched = 0;   ///< within the gate, facing alike
  std::size_t in_front = 0;  ///< before the other view's surface by more than the gate
  std::size_t crossed = 0;   ///< within the gate, facing otherwise
  double quality = 0;        ///< sum over the matched of 1 - (distance / gate)²
  std::size_t fewer = 0;     ///< the smaller of the two views' numbers of samples

  double overlap() const { return fewer > 0 ? 0.5 * static_cast<double>(matched) / static_cast<double>(fewer) : 0; }
  /// Share of what contradicts the pose among all that says something.
  double contradiction() const {
    std::size_t const against = in_front + crossed;
    return matched + against > 0 ? static_cast<double>(against) / static_cast<double>(matched + against) : 1;
  }
  /// Grows with what agrees, falls with what contradicts; samples that miss say nothing.
  double score() const { return quality - 1.5 * static_cast<double>(in_front) - 0.5 * static_cast<double>(crossed); }
};

PoseCheck check_pose(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a, double gate,
                     std::size_t max_samples);

struct PairSearchOptions {
  double radius = 1;  ///< of the object, units
  int nearest = 4;    ///< matches of a feature
};

/// One relative pose of two views, found or judged.
struct PairPose {
  Eigen::Isometry3d b_from_a = Eigen::Isometry3d::Identity();
  PoseCheck check;      ///< at the end, on the finest level that was used
  double misfit = 0;    ///< robust standard deviation of the distances, in their sigmas
  double distance = 0;  ///< robust standard deviation of the distances, units
  double likeness = 1;  ///< correlation of the print where the surfaces meet; 1 where a view has none
  /// `firm`: nothing contradicts it, and it fits as well as noise lets it. `weak`: it may be right, as poses of sensors
  /// whose depths bend are; other views must confirm it.
  enum class Verdict { refused, weak, firm } verdict = Verdict::refused;
  /// What speaks for it: `PoseCheck::score`, less where print does not meet itself.
  double strength() const { return std::max(0.0, check.score()) * std::max(likeness, 0.0); }
  std::vector<Eigen::Isometry3d> others;  ///< further poses that were looked at to the end
};

/// Whether a view's colour is more than a plain surface's noise.
bool has_print(SurfacePyramid const& view);

/// `PoseCheck::score` on the second level; where both views have print, the less it meets itself the less.
double pose_score(SurfacePyramid const& a, SurfacePyramid const& b, Eigen::Isometry3d const& b_from_a, double gate,
                  double radius, std::size_t max_samples, bool are_printed);

/// The pose of a in b's frame from nothing: two matched features with their normals make a pose (point pairs; Drost and
/// others 2010), all such pairs whose distances and angles agree are looked at, the best by `PoseCheck` on a few
/// samples are refined by projection, coarse to fine, and the best of these is judged. Where both views have print, it
/// must meet itself: shapes with symmetries have several poses. `features`: each kind's of a and of b. Deterministic.
/// `starts`: poses to be considered as well.
PairPose search_pair(SurfacePyramid const& a, SurfacePyramid const& b,
                     std::vector<std::pair<Features const*, Features const*>> const& features,
                     std::vector<Eigen::Isometry3d> const& starts, PairSearchOptions const& options);

}  // namespace scanview
