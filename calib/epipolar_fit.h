#pragma once
#include <Eigen/Core>
#include <vector>

#include "base/context.h"
#include "calib/essential_search.h"
#include "calib/stereo_rig.h"

namespace scanview {

/// One surface point in both pictures: pixels of the distorted pictures. `sigma_px` is the standard deviation of each
/// of the four coordinates (where only the right pixel is uncertain, its deviation divided by √2).
struct Correspondence {
  Eigen::Vector2d left = Eigen::Vector2d::Zero(), right = Eigen::Vector2d::Zero();
  float sigma_px = 0.3F;
};

/// How far a match is from being possible, signed, in pixels of the distorted pictures. NaN where a lens has no
/// inverse.
struct EpipolarResidual {
  double sampson_px = 0;  ///< how far both pixels together must move, to first order (Hartley, Zisserman, eq. 11.9)
  double line_px = 0;     ///< from the right pixel to the epipolar line of the left one, across that line
  RayPair rays;           ///< the straight rays of the two pixels
};
EpipolarResidual epipolar_residual(StereoRig const& rig, Eigen::Vector2d const& left, Eigen::Vector2d const& right);

struct EpipolarFitOptions {
  bool focal = false;         ///< one factor on all four focal lengths is unknown too
  bool k1 = false;            ///< one amount added to both lenses' k1 is unknown too
  double cauchy_sigmas = 2;   ///< scale of the Cauchy loss, in standard deviations of a match; 0: plain least squares
  double least_gain = 1e-10;  ///< it ends with a step that lowers the cost by no more than this share
  double largest_step = 0.5;  ///< the focal lengths change by at most this natural logarithm in total
};

struct EpipolarFit {
  /// The translation has length 1. Standard deviations are those of the fit: rotation.* in radians about the right
  /// camera's axes, translation.*, and where they were unknown left.fx .. right.fy and left.k1, right.k1.
  StereoRig rig;
  double mean_square = 0;  ///< of Sampson residual / sigma_px; about 1 where the model and sigma_px are right
  double cost = 0;         ///< mean of the loss, in the same unit
  double focal_std = 0;    ///< standard deviation of the focal lengths' natural logarithm
  double k1_std = 0;       ///< of the common k1
  bool usable = false;     ///< it ended at a finite optimum inside the limits
};

/// Bundle adjustment of two pictures with the points eliminated: minimises Σ ρ((sampson / sigma)²) over the pose (five
/// degrees of freedom) and what else is unknown, from `start`. A standard deviation is the larger of two: from the
/// information matrix, scaled by the residuals found; and from the scatter of the gradient over cells of the left
/// picture (the sandwich), which stays honest where neighbouring matches share an error. Time grows linearly; 20 000
/// matches take some hundredths of a second. At least 8 matches. The same for any number of threads.
EpipolarFit fit_epipolar(std::vector<Correspondence> const& matches, StereoRig const& start,
                         EpipolarFitOptions const& options, Context& context);

}  // namespace scanview
