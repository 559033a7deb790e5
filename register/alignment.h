#pragma once
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"

namespace scanview {

struct RegisterOptions {
  /// `automatic`: from the views alone (search_start.h). `none`: all at the same place. `turntable`: a search first,
  /// where neither step nor axis are given; where it does not join all views, equal turns about one axis.
  enum class Init { given, automatic, none, turntable } init = Init::given;
  /// `turntable`: degrees a view, positive or negative; 0: a full turn over all views.
  double turntable_step_deg = 0;
  /// `turntable`: axis direction in the first camera's coordinates; zero: fitted.
  Eigen::Vector3d turntable_axis{0, 0, 0};
  bool refine = true;
  int levels = 4;           ///< of the pyramid, coarse to fine
  int max_iterations = 50;  ///< joint refinements with fresh correspondences
  /// Samples of a view that are matched with another one at the end, at most: the knob between speed and error, which
  /// falls with their square root. 0: all, where neighbours do not share their errors.
  int max_correspondences = 0;
  double min_overlap = 0.1;  ///< share of a view's depths that another view sees: pairs below are not used
  /// `given`: one standard deviation of the given poses, as a share of a view's radius (a rotation moves a point at
  /// this radius). Where the data says more, this changes nothing; where surfaces nearly slide it keeps a pose near
  /// where it was measured to be. 0: the given poses are a start, and nothing is believed.
  double given_std = 0.02;
  void validate() const;
};

/// Two views that overlap, at the final poses.
struct PairFigures {
  std::size_t a = 0, b = 0;    ///< indices of views
  double overlap = 0;          ///< share of a's depths with a correspondence in b
  double rms = 0;              ///< point-to-plane, units
  double median_distance = 0;  ///< point-to-plane absolute, units
  double inliers = 0;          ///< share of correspondences within 3 robust sigma
  bool suspicious = false;     ///< a warning was given
};

struct PoseFigures {
  double std_deg = 0, std_length = 0;  ///< one standard deviation, at the view's centroid
};

enum class AlignmentStatus { converged, not_converged, disconnected };

struct Alignment {
  std::vector<Eigen::Isometry3d> object_from_camera;  ///< a view each; the first view keeps its pose
  std::vector<PairFigures> pairs;
  std::vector<PoseFigures> poses;
  std::vector<std::vector<std::size_t>> parts;  ///< connected parts of the overlap graph, largest first
  std::vector<std::string> unobservable;        ///< motions the data does not constrain, in words
  ErrorPart error;                              ///< distance between overlapping surfaces (error budget)
  AlignmentStatus status = AlignmentStatus::converged;
  int iterations = 0;
};

/// Aligns the views of a set: initial poses by `init`, coarse-to-fine point-to-plane ICP of neighbours (PCL, Chen and
/// Medioni 1991), then all overlapping pairs in one Ceres problem with fresh projective correspondences each round.
/// Throws Error{bad_input} where `given` is asked for and a view has no pose, or the set has no depths.
Alignment align(ScanSet const& set, RegisterOptions const& options, Context& context);

/// Pairwise relative errors of poses against a reference, compared at the centroid of what two views share (at the
/// centre where they share nothing): rotation in degrees, translation in units.
struct PoseComparison {
  double median_deg = 0, max_deg = 0, median_length = 0, max_length = 0;
};
PoseComparison compare_poses(ScanSet const& set, std::vector<Eigen::Isometry3d> const& poses,
                             std::vector<Eigen::Isometry3d> const& reference);
/// Each pose against the reference after the one rigid motion that fits them best: the worst of all.
PoseComparison compare_poses_absolute(ScanSet const& set, std::vector<Eigen::Isometry3d> const& poses,
                                      std::vector<Eigen::Isometry3d> const& reference);

}  // namespace scanview
