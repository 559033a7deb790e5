#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "base/context.h"
#include "base/files.h"
#include "calib/epipolar_fit.h"
#include "calib/stereo_rig.h"

namespace scanview {

struct RelativePoseOptions {
  bool refine_focal = false;         ///< both cameras' focal lengths by one factor
  bool refine_distortion = false;    ///< both lenses' k1 by one amount
  double threshold_px = 2;           ///< how far a match may be from its epipolar line in the first search
  std::size_t min_matches = 50;      ///< fewer are refused
  double min_inlier_share = 0.25;    ///< fewer matches on one geometry are no consensus
  double min_angle_deg = 1;          ///< the median angle between a point's two rays
  double max_focal_std = 0.02;       ///< relative; a focal length less certain than this is held
  double max_distortion_px = 1;      ///< deviation that k1's uncertainty may cause at the outermost matches, else held
  std::size_t most_matches = 20000;  ///< so many, spread over the picture, take part in the adjustment

  /// Throws Error{usage} naming the option.
  void validate() const;
};

struct RelativePoseResult {
  enum class Status {
    solved,
    too_few,              ///< fewer than min_matches that the lenses have a ray for
    no_consensus,         ///< too few matches agree on one geometry
    degenerate_baseline,  ///< the rays meet under less than min_angle_deg (a rotation alone is 0)
    planar_ambiguous      ///< two poses explain the matches equally well: the scene is nearly a plane
  };
  Status status = Status::too_few;
  std::string reason;  ///< what happened and what to do, one sentence; empty where solved
  /// The translation has length 1, unit "arbitrary". Filled but not to be trusted for the last three.
  StereoRig rig;
  std::optional<Eigen::Isometry3d> alternative;  ///< planar_ambiguous: the other pose
  std::vector<std::string> held;                 ///< what was to be refined but cannot be determined, with the reason
  double epipolar_median_px = 0, epipolar_rms_px = 0;  ///< right pixel to epipolar line, over the inliers
  std::size_t matches = 0, inliers = 0;                ///< usable ones; within 3.5 robust deviations, in front
  double angle_deg = 0;                                ///< median angle between the rays of an inlier
  double focal_factor = 1;                             ///< refined / given focal length

  bool solved() const { return status == Status::solved; }
  Json to_json() const;
};

/// The pose of the right camera from matches alone, intrinsics known: five-point samples, then a robust adjustment of
/// the pose (and of what is asked for) on matches spread over the left picture, then plain least squares on the
/// inliers of that. Wrong matches may be a good part of all. The scale is free. A nearly planar scene has a second
/// pose: it is derived from the plane, adjusted too, and believed to be wrong only where it fits visibly worse. Throws
/// Error{bad_input} where a match is not finite or a deviation not positive, Error{usage} for orthographic cameras.
/// Deterministic for a seed, whatever the number of threads. Half a million matches take a few tenths of a second.
RelativePoseResult solve_relative_pose(std::vector<Correspondence> matches, LensCamera const& left,
                                       LensCamera const& right, RelativePoseOptions const& options, Context& context);

std::string to_string(RelativePoseResult::Status status);

}  // namespace scanview
