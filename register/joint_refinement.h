#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <string>
#include <vector>

#include "register/pair_form.h"

namespace scanview {

/// What one pair of views asks for: the motion t of view a in b's frame, away from `b_from_a`, costs
/// t' information t + 2 gradient' t.
struct PairMeasurement {
  std::size_t a = 0, b = 0;
  Eigen::Isometry3d b_from_a = Eigen::Isometry3d::Identity();
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  Eigen::Vector3d center{0, 0, 0};
};

/// Where the views stand and what holds them. Pose increments are motions about a view's centroid in its camera frame.
struct JointProblem {
  std::vector<Eigen::Isometry3d> object_from_camera;
  std::vector<Eigen::Vector3d> centroids;  ///< camera coordinates
  std::vector<bool> fixed;                 ///< these views stay
  double radius = 1;                       ///< scales rotations
  std::vector<PairMeasurement> pairs;
  /// What the poses were believed to be before any data was seen, and how firmly: one standard deviation of every
  /// component of a pose's increment, units. Acts along motions that the pairs hold less firmly than that, and hardly
  /// along others. Empty and 0: nothing was known. Does not enter the spectrum.
  std::vector<Eigen::Isometry3d> believed;
  double belief_std = 0;
};

/// Lays views onto each other along pairs, the first pairs first, where they join parts that were apart (Kruskal). The
/// parts move as one; the one with the smallest view stays. Returns which pairs were used.
std::vector<std::size_t> place_along(std::vector<PairMeasurement> const& pairs,
                                     std::vector<Eigen::Isometry3d>& object_from_camera);

/// Motions of all views together, 6 numbers a view (zero for fixed views), that the pairs do not constrain, as columns
/// of an orthonormal basis; and the covariance of the rest.
struct JointSpectrum {
  Eigen::MatrixXd free_motions;
  Eigen::MatrixXd covariance;  ///< 6n x 6n
};
/// The spectrum of the information matrix. A motion is free whose eigenvalue is below 1e-8 of the largest, or whose
/// standard deviation exceeds 5 % of the radius: such a pose would be a guess. Cost: cubic in the number of views.
JointSpectrum joint_spectrum(JointProblem const& problem);

/// The free motions in words, views by name, directions in object coordinates.
std::vector<std::string> describe_free_motions(JointProblem const& problem, JointSpectrum const& spectrum,
                                               std::vector<std::string> const& names);

enum class PairLoss { quadratic, cauchy };
struct JointStep {
  std::vector<Eigen::Isometry3d> object_from_camera;
  std::vector<Vector6d> twists;  ///< a view's increment, about its centroid
  double largest = 0;            ///< of all views: length of the increment, rotations times radius
  double gain = 0;  ///< by how much the cost (in variances) fell: far below 1, no data tells the difference
};
/// Minimises the sum of all pairs (Ceres, one thread). Free motions are held: the result differs from the start only
/// in what the pairs constrain. `cauchy` doubts pairs whose cost exceeds 1 (initial poses from pairwise motions).
JointStep solve_joint(JointProblem const& problem, JointSpectrum const& spectrum, PairLoss loss);

/// Pairs that the others contradict, in order of `problem.pairs`: data snooping (Baarda, A testing procedure for use in
/// geodetic networks, 1968). All pairs are balanced; what a pair is off, in the deviations that its own error would
/// give it there, is compared with what chance allows, or with what is usual in this problem where that is more (a
/// sensor whose depths bend errs everywhere). The worst goes, and the rest is balanced anew. A loop that does not
/// close, but in which each of several pairs might be the wrong one, blames none. Cost: cubic in the number of views,
/// for each found.
std::vector<std::size_t> find_false_pairs(JointProblem const& problem);

}  // namespace scanview
