#pragma once
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <opencv2/core/types.hpp>
#include <optional>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace scanview {

// Inside of calibrate(): the unknowns, what was observed, and the solver.

enum class Side { left = 0, right = 1 };

inline constexpr int kLensUnknowns = 9;  // fx fy cx cy k1 k2 p1 p2 k3
inline constexpr int kRight = kLensUnknowns, kRotation = 2 * kLensUnknowns, kTranslation = kRotation + 3;
inline constexpr int kShared = kTranslation + 3;
using SharedVector = Eigen::Matrix<double, kShared, 1>;
using SharedMatrix = Eigen::Matrix<double, kShared, kShared>;
using PoseVector = Eigen::Matrix<double, 6, 1>;  // rotation vector, translation

std::string shared_name(int index);
PoseVector to_vector(Eigen::Isometry3d const& pose);
Eigen::Isometry3d to_pose(PoseVector const& vector);

/// What is solved for: both lenses, right from left, and left_from_board of each board.
struct Estimate {
  SharedVector shared = SharedVector::Zero();
  std::vector<PoseVector> poses;

  LensCamera camera(Side side, cv::Size size) const;
  Eigen::Isometry3d right_from_left() const { return to_pose(shared.segment<6>(kRotation)); }
};

struct Observation {
  std::size_t board = 0;
  Side side = Side::left;
  int id = 0;
  Eigen::Vector2d on_board = Eigen::Vector2d::Zero(), pixel = Eigen::Vector2d::Zero();
  double sigma_px = 0;  ///< as the corner says
  bool corner_ok = true;
};

struct Problem {
  std::vector<Observation> observations;
  std::vector<bool> board_used;
  std::array<double, 2> extra_px = {0, 0};  ///< per camera: deviation beyond what corners say
  std::array<bool, kShared> held = {};

  bool uses(Observation const& o) const { return o.corner_ok && board_used[o.board]; }
  double deviation(Observation const& o) const;
};

/// Model minus seen, pixels; NaN behind the camera.
Eigen::Vector2d residual(Estimate const& estimate, Observation const& observation);

struct SolveOptions {
  double cauchy_sigmas = 0;  ///< 0: plain least squares
  bool poses_only = false;
};
/// Improves the estimate over the observations in use. Returns whether it ended at finite values.
bool solve(Problem const& problem, Estimate& estimate, SolveOptions const& options);

/// One board's pose alone from the chosen observations (indices), robustly; the rest of the estimate stays.
PoseVector solve_pose(Problem const& problem, Estimate const& estimate, std::size_t board,
                      std::vector<std::size_t> const& observations);

/// Covariance of the shared unknowns, the poses eliminated, for weights 1 / deviation²; rows of held ones are 0. Where
/// the data leave a direction open its deviation is huge but finite. `chi2` and `freedom` of the same residuals.
struct Covariance {
  SharedMatrix matrix = SharedMatrix::Zero();
  double chi2 = 0, freedom = 0;
};
Covariance covariance(Problem const& problem, Estimate const& estimate);

/// Initial values by OpenCV, a camera at a time, then the rig that most boards agree with.
struct Start {
  Estimate estimate;
  std::size_t agreeing = 0, common = 0;  ///< boards that both cameras saw: that agree on the rig, all
};
Start start_values(std::vector<BoardView> const& views, CalibrateOptions const& options);

/// Pose of a board before one camera with a known lens.
std::optional<Eigen::Isometry3d> pose_before(LensCamera const& camera, std::vector<BoardCorner> const& corners,
                                             BoardDescription const& board);

/// Chessboards whose colours do not tell how they are turned: the right view's ids follow the left's.
void align_turns(std::vector<BoardView>& views, BoardDescription const& board);

/// The corners as a mirror shows them; ids so that the board is not mirrored.
std::vector<BoardCorner> mirrored(std::vector<BoardCorner> corners, BoardDescription const& board, int width);

}  // namespace scanview
