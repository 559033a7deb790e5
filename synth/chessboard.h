#pragma once
#include <Eigen/Geometry>
#include <array>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "base/context.h"
#include "calib/stereo_rig.h"
#include "synth/sensor.h"

namespace scanview {

/// A flat chessboard. Its frame has the origin in the first inner corner, x along a row of corners, y down the rows,
/// z into the board (OpenCV's object points, z = 0).
struct Chessboard {
  int columns = 9, rows = 6;  ///< inner corners
  double square = 10;         ///< mm
  Eigen::Vector3d corner(int column, int row) const { return {column * square, row * square, 0}; }
  Eigen::Vector3d center() const { return corner(columns - 1, rows - 1) / 2; }
  /// Light that the board sends back at a place of its plane: 0 to 1; negative outside its white margin.
  float reflectance(double x, double y) const;
};

struct BoardPoses {
  Chessboard board;
  std::vector<Eigen::Isometry3d> left_from_board;
};

/// `count` poses about `distance` away from the left camera, their centres spread over its picture, tilted by up to 40
/// degrees and turned by up to 30; all of every board is in both pictures. The squares are as large as lets a board
/// fill about half the picture's width. Fewer poses where the rig does not see a board that fits (cameras far apart).
BoardPoses make_board_poses(StereoRig const& rig, double distance, int count, std::uint64_t seed);

/// The pictures that the left and the right camera take of board `index`: edges are integrated over
/// the pixels and softened by half a pixel, as no lens is perfectly sharp.
std::array<cv::Mat, 2> take_board(StereoRig const& rig, BoardPoses const& poses, std::size_t index,
                                  Sensor const& sensor, Context& context);

}  // namespace scanview
