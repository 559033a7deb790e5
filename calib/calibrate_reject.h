#pragma once
#include <string>
#include <vector>

#include "calib/calibrate_problem.h"

namespace scanview {

// Inside of calibrate(): which boards and corners no model explains.

/// RMS of one camera's residuals of a board in standard deviations of a coordinate, over the corners that are not
/// outliers; the same robustly (from the median); in pixels; how many corners are outliers.
struct ViewFigures {
  std::size_t corners = 0, outliers = 0;
  double rms = 0, robust = 0, rms_px = 0;
};

/// Estimates what corners' own deviations do not explain, per camera, so that the residuals in use have variance 1.
/// `robust`: from their median, outliers may be among them; otherwise from their mean square and the unknowns solved.
enum class NoiseFrom { median, mean };
void estimate_noise(Problem& problem, Estimate const& estimate, NoiseFrom from);

/// Robust solve, test of every board and corner, again until the verdict stays. Boards that were out are fitted to the
/// others' lenses and may come back. Fills corner_ok and board_used.
void reject(Problem& problem, Estimate& estimate, CalibrateOptions const& options, Context& context);

/// Why a rejected board disagrees, in words.
std::string why_rejected(Problem const& problem, Estimate const& estimate, std::size_t board,
                         std::vector<BoardView> const& views, CalibrateOptions const& options);

}  // namespace scanview
