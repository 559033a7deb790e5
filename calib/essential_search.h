#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "base/context.h"

namespace scanview {

/// A match as two straight rays (x/z, y/z).
struct RayPair {
  Eigen::Vector2d left = Eigen::Vector2d::Zero(), right = Eigen::Vector2d::Zero();
};

/// A pose that explains matches: the translation has length 1.
struct PoseCandidate {
  Eigen::Isometry3d right_from_left = Eigen::Isometry3d::Identity();
  double score = 0;  ///< mean of min(1, (sampson / threshold)²) over the matches: 0 is perfect, 1 is none
};

struct EssentialSearchOptions {
  double threshold = 1e-3;          ///< Sampson distance of an inlier, normalised (pixels / focal length)
  int most_samples = 2000;          ///< of five matches
  double failure_chance = 1e-4;     ///< stops when a better sample has been missed with no more than this
  std::size_t most_candidates = 4;  ///< poses that differ by at least half a degree in turn or two in direction
};

/// Poses that most matches agree with, best first: minimal samples of five (Nistér 2004, OpenCV's solver, which draws
/// no random numbers for exactly five), scored as MSAC does, in front of both cameras decided by the inliers. The same
/// seed gives the same answer. Empty where there are fewer than six matches or no sample has a solution. Time: samples
/// × matches; a thousand or two well-spread matches are enough.
std::vector<PoseCandidate> search_essential(std::vector<RayPair> const& matches, EssentialSearchOptions const& options,
                                            Context& context);

/// Whether the pose puts the point of a match in front of both cameras, or at infinity.
bool in_front(RayPair const& match, Eigen::Isometry3d const& right_from_left);

/// Share of matches that the pose puts in front of both cameras. NaN without matches.
double share_in_front(std::vector<RayPair> const& matches, Eigen::Isometry3d const& right_from_left);

/// Depths along z of a match in the left and the right camera (midpoint of the rays' closest approach), and the angle
/// between the rays in radians.
struct RayMeeting {
  double left_depth = 0, right_depth = 0, angle_rad = 0;
};
RayMeeting meet(RayPair const& match, Eigen::Isometry3d const& right_from_left);

/// Whether two poses are the same but for so many radians in turn and in direction of the translation.
bool nearly_equal(Eigen::Isometry3d const& a, Eigen::Isometry3d const& b, double turn_rad, double direction_rad);

}  // namespace scanview
