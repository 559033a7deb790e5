#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "register/view_surface.h"

namespace scanview {

using Vector6d = Eigen::Matrix<double, 6, 1>;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// A small motion of view a in view b's camera frame: y -> y + (w/radius) x (y - center) + v, written (w, v). With the
/// rotation scaled by a radius all six numbers are lengths.
Eigen::Isometry3d motion(Vector6d const& twist, Eigen::Vector3d const& center, double radius);
/// The inverse of `motion`, for motions below half a turn.
Vector6d twist_of(Eigen::Isometry3d const& motion, Eigen::Vector3d const& center, double radius);

/// How far apart two motions carry a centroid and two points a radius beside it, at most.
double motion_difference(Eigen::Isometry3d const& l, Eigen::Isometry3d const& r, Eigen::Vector3d const& centroid,
                         double radius);

/// Which correspondences count, and how much.
struct MatchOptions {
  double gate = 0;  ///< depth difference beyond which two views see different surfaces, units
  double min_normal_cos = 0.6;
  double radius = 1;          ///< scales rotations, units
  double geometry_scale = 1;  ///< robust standard deviation of the distances, in multiples of their sigma
  double tone_scale = 0.2;    ///< of the tone differences
  /// Weight of a correspondence against independent ones: neighbours share their errors (see `effective_share`).
  double geometry_share = 1, tone_share = 1;
  std::size_t max_samples = 4000;  ///< a direction
  enum class Use { shape, shape_and_tone } use = Use::shape_and_tone;
  /// The pose is right to a pixel or so: sharp features hold firmly, from afar their planes mislead; and corresponding
  /// normals differ by their noise only, which then need not count as information.
  bool is_near = false;
  /// Take out the motions that only noise of normals seems to constrain. Far from the right pose normals differ because
  /// the pose is wrong, and what would mend it must not be held.
  bool hold_free_motions = true;
};

/// Sums over residuals of one kind, from which scale and correlation are measured.
struct ResidualFigures {
  std::vector<float> values;       ///< geometry: in sigmas; tone: differences
  double product = 0, square = 0;  ///< of horizontal neighbours: their correlation
  double correlation() const { return square > 0 ? product / square : 0; }
};

/// All correspondences of two views, both ways, reduced to a quadratic form in the motion of a against b:
/// cost(t) = t' information t + 2 gradient' t + constant, in units of variance.
struct PairForm {
  Matrix6d information = Matrix6d::Zero();
  Vector6d gradient = Vector6d::Zero();
  Eigen::Vector3d center{0, 0, 0};         ///< of the motion, in b's camera frame
  std::size_t asked_ab = 0, asked_ba = 0;  ///< samples looked up
  std::size_t hits_ab = 0, hits_ba = 0;    ///< those that met the same surface
  double cost = 0;              ///< truncated mean cost, 0 (all coincide) to 1 (nothing does); see `match_pair`
  double tone_correlation = 0;  ///< of the tones at corresponding points; 0 without tone
  int held = 0;                 ///< motions that neither shape nor tone constrain
  ResidualFigures geometry, tone;
  std::vector<float> distances;  ///< point to plane, units
};

/// Projects the samples of each view into the other camera (`b_from_a` * p_a = p_b), looks up the surface there, and
/// compares point to plane (Chen and Medioni 1991) and, where both have colour, tone to tone (the photometric part of
/// coloured ICP; Park, Zhou, Koltun 2017). Tukey weights with the given scales. Motions that only the noise of the
/// normals seems to constrain are taken out: with the normals of one view in one factor and those of the other in the
/// other, noise cancels in the mean, so that a plane shows its three free motions and a sphere too.
/// `cost` counts a sample that misses (outside, or no surface within the gate) as 1.
PairForm match_pair(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a,
                    Eigen::Vector3d const& centroid_a, Eigen::Vector3d const& centroid_b, MatchOptions const& options);

/// Which of the samples of `from` (those of its grid for `max_samples`, in order) `to` sees: within the gate along its
/// depth, facing alike.
std::vector<bool> seen_samples(ViewSurface const& from, ViewSurface const& to, Eigen::Isometry3d const& to_from_from,
                               MatchOptions const& options);

/// Median absolute deviation from zero, scaled to a standard deviation of a normal distribution. Reorders the values.
double robust_scale(std::vector<float>& values);
/// Tukey's biweight, of a residual in standard deviations: 1 at 0, 0 beyond 4.685 (95 % efficient for normal noise).
double tukey_weight(double residual_in_scales);
/// Share of correspondences that count as independent where neighbours along either axis have this correlation:
/// ((1 - c)/(1 + c))^2, of a separable autoregressive field.
double effective_share(double correlation);

/// The surface of a view where a point falls: bilinear normal, and linear depth between the pixels as it is where the
/// surface bends evenly (chords cut curvature off, on both views' slanted sides, and pull the views together).
struct SurfaceHit {
  Eigen::Vector3d point, normal;
  Eigen::Vector2d pixel;
  double sigma = 0;
  bool crease = false;
  /// Of the angle between the ray and the normal.
  double cosine(Camera const& camera) const {
    return camera.is_perspective() ? -normal.dot(point) / point.norm() : -normal.z();
  }
};
/// False where the point falls outside or on no surface.
bool look_up(ViewSurface const& surface, Eigen::Vector3d const& p_camera, SurfaceHit& hit);

}  // namespace scanview
