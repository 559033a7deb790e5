#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

namespace scanview {

/// A flat calibration board. A corner's id counts row by row from the top left, seen from the printed side.
struct BoardDescription {
  enum class Kind { chessboard, charuco };
  /// How OpenCV arranged a ChArUco board: `old` (up to 4.5) puts marker 0 into the top-left square where the number of
  /// rows is even, `current` always makes that square black. With an odd number of rows both are the same.
  enum class Layout { automatic, old, current };

  Kind kind = Kind::chessboard;
  int columns = 9, rows = 6;  ///< chessboard: inner corners; ChArUco: squares
  double square = 1;          ///< side of a square, in the rig's unit
  double marker = 0;          ///< side of a marker, same unit (ChArUco)
  std::string dictionary;     ///< OpenCV's name, as DICT_5X5_1000 (ChArUco)
  Layout layout = Layout::automatic;

  int corner_columns() const { return kind == Kind::charuco ? columns - 1 : columns; }
  int corner_rows() const { return kind == Kind::charuco ? rows - 1 : rows; }
  int corner_count() const { return corner_columns() * corner_rows(); }
  /// On the board's plane: x right, y down, the first corner at (0, 0).
  Eigen::Vector2d corner(int id) const;
  std::string name() const;  ///< "9x6", "charuco:25x18"
  /// Throws Error{usage} naming what makes no sense.
  void validate() const;
};

/// "9x6" (inner corners) or "charuco:25x18" (squares). Throws Error{usage}.
BoardDescription parse_board(std::string const& text, double square, double marker, std::string const& dictionary);
std::string to_string(BoardDescription::Layout layout);

/// One corner in one picture. `sigma_px` is the standard deviation of each coordinate as the fit to the picture's
/// values gives it.
struct BoardCorner {
  int id = 0;
  Eigen::Vector2d pixel = Eigen::Vector2d::Zero();
  double sigma_px = 0.1;
};

/// What was found in one picture; `why` says in words why `corners` is empty.
struct DetectedBoard {
  std::vector<BoardCorner> corners;  ///< ascending ids; a chessboard has all or none
  BoardDescription::Layout layout = BoardDescription::Layout::automatic;  ///< ChArUco: in which the ids are
  /// ChArUco: markers that lie where each layout has them. The layouts differ by a shift of one square but for the
  /// ends of rows, so a part of a board may fit both: then the ids are those of the current one.
  int old_markers = 0, current_markers = 0;
  std::string why;

  bool found() const { return !corners.empty(); }
};

/// Finds the board and refines its corners (board_refine.h). Picture: 8 or 16 bits, gray or BGR. A chessboard is
/// numbered so that the square outside corner 0 is dark where its colours tell it from a board turned by half a turn
/// (columns + rows odd), and never mirrored. Throws Error{usage} for a description that makes no sense. Time: up to a
/// second for 2048 × 1500.
DetectedBoard detect_board(cv::Mat const& picture, BoardDescription const& board);

}  // namespace scanview
