#pragma once
#include <Eigen/Core>
#include <functional>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "calib/board.h"

namespace scanview {

/// Where the board's plane comes to lie in a picture, near one of its corners: pixel of a point given in squares from
/// that corner. Only its first and second derivatives at (0, 0) are used.
using LocalWarp = std::function<Eigen::Vector2d(Eigen::Vector2d const& squares)>;

struct CornerFitOptions {
  double reach_squares = 0.42;  ///< half side of the window, in squares
  /// Pixels that are further than this from both edges are left out (ChArUco: its markers' distance), in squares.
  double clear_squares = 1;
  bool curved = true;  ///< use the warp's second derivatives
};

struct CornerFit {
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< of each coordinate (root mean square of both), scaled by the residuals found
  double contrast = 0;  ///< half the step between dark and bright, in the picture's unit; sign: which squares are dark
  double blur_px = 0;   ///< standard deviation of the edge's blur
  double residual = 0;  ///< RMS of the fit in the picture's unit
  bool usable = false;
};

/// Least-squares fit of a blurred saddle to the picture's values around a corner:
///   I = b + b·d + (c + c·d) erf(e₁/√2s) erf(e₂/√2s)
/// d is the offset from the corner, e₁, e₂ the distances from its two edges, s the blur: eleven unknowns. Edges are
/// straightened by the warp's second derivatives first, since a curved edge would shift the corner. The model is
/// symmetric about the corner, and so are window and mask: blur, response curve and blooming do not move it.
CornerFit fit_corner(cv::Mat1f const& picture, LocalWarp const& warp, CornerFitOptions const& options);

}  // namespace scanview
