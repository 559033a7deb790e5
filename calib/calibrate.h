#pragma once
#include <Eigen/Geometry>
#include <limits>
#include <map>
#include <opencv2/core/types.hpp>
#include <string>
#include <vector>

#include "base/context.h"
#include "calib/board.h"
#include "calib/stereo_rig.h"

namespace scanview {

/// One board as both cameras saw it at one moment; no corners where a camera did not see it.
struct BoardView {
  std::string name;
  std::vector<BoardCorner> left, right;
};

struct CalibrateOptions {
  BoardDescription board;
  cv::Size left_size, right_size;  ///< of the pictures; right: empty where there is one camera only
  std::string unit = "mm";         ///< of BoardDescription::square
  enum class Holdout { off, on } holdout = Holdout::off;
  /// A board is rejected where its corners' RMS exceeds so many times what the others' noise explains.
  double board_limit = 3;
  /// A corner is rejected beyond so many standard deviations (of its own board's, where that is noisier).
  double corner_limit = 6;
  /// Distortion that images determine worse than this at the picture's corner (pixels, one standard deviation) loses
  /// its insignificant terms.
  double distortion_limit_px = 1;
  double focal_limit = 0.05;  ///< relative standard deviation from which the focal length counts as unobservable
  /// Throws Error{usage} naming the field.
  void validate() const;
};

/// A corner after the solve: what the model says minus what was seen, in pixels.
struct CornerResidual {
  int id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero(), residual = Eigen::Vector2d::Zero();
  bool used = true;
};

struct BoardFit {
  std::string name;
  bool used = true;
  std::string why;  ///< of a rejection, in words
  Eigen::Isometry3d left_from_board = Eigen::Isometry3d::Identity();
  std::vector<CornerResidual> left, right;
  double rms_px = 0;  ///< sqrt(sum of squared 2-D distances / corners), both cameras
  /// Symmetric epipolar RMS of a solve without this board; NaN where one camera did not see it, or not asked for.
  double holdout_px = std::numeric_limits<double>::quiet_NaN();
};

struct Parameter {
  std::string name;  ///< "left.fx", "right.k3", "rotation.x" (rotation vector, radians), "translation.z" ...
  double value = 0, std = 0;
};

struct NamedReason {
  std::string name, why;
};

struct Calibration {
  enum class Status {
    solved,
    too_few_boards,   ///< fewer than three in a camera, or in both at once
    parallel_boards,  ///< the focal length cannot be determined
    inconsistent,     ///< no one rig explains half of the boards
  };
  Status status = Status::too_few_boards;
  std::string reason;  ///< one sentence; empty where solved
  bool stereo = true;  ///< otherwise the left camera alone
  StereoRig rig;
  std::vector<Parameter> parameters;  ///< those that were solved for
  std::vector<NamedReason> held;      ///< distortion terms left at 0
  std::vector<BoardFit> boards;       ///< all that were seen, in the order given
  std::size_t corners = 0;            ///< used, over both cameras
  std::size_t corners_rejected = 0;   ///< of boards that were used
  /// sqrt(sum of squared 2-D distances / corners) over the boards used, both cameras: what OpenCV's stereoCalibrate
  /// returns.
  double rms_px = 0;
  double noise_left_px = 0, noise_right_px = 0;  ///< of one coordinate, estimated
  /// RMS over the corners of all boards that both cameras saw, rejected ones too.
  double holdout_epipolar_rms_px = std::numeric_limits<double>::quiet_NaN();

  bool solved() const { return status == Status::solved; }
  std::size_t boards_used() const;
  std::vector<NamedReason> boards_rejected() const;
  Json to_json() const;
};

/// Both cameras, their pose and all board poses in one least-squares problem (docs/calib.md). Initial values from
/// OpenCV; a robust solve finds boards and corners that no model explains; a plain one on the rest gives values and
/// covariance. Corners weigh by their own deviation and by what it does not explain of the residuals. With no right
/// view at all the left camera is calibrated alone. Throws Error{usage}. Deterministic; time grows linearly with the
/// corners (13 boards of 54: a tenth of a second), with hold-out once more for each board.
Calibration calibrate(std::vector<BoardView> const& views, CalibrateOptions const& options, Context& context);

/// Distance of a pair of pixels from each other's epipolar line in the ideal pictures: sqrt of the mean of both
/// squares. NaN where a lens has no inverse.
double epipolar_distance(StereoRig const& rig, Eigen::Vector2d const& left, Eigen::Vector2d const& right);

/// rig.yml: the rig, or where the left camera was calibrated alone M1, D1, its size and deviations only, which
/// read_stereo_rig refuses. Whole or not at all.
void write_calibration(std::filesystem::path const& path, Calibration const& calibration);

std::string to_string(Calibration::Status status);

}  // namespace scanview
