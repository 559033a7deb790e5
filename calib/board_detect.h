#pragma once
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "calib/board.h"

namespace scanview {

// The two halves of detect_board, before refinement. Pictures are 8 bits gray.

/// A chessboard's corners in the order of ids, to a pixel or so; empty where there is none.
std::vector<cv::Point2f> find_chessboard(cv::Mat1b const& gray, BoardDescription const& board);

/// A ChArUco board's corners; entries are missing where no marker beside them was read.
struct CharucoCorners {
  std::vector<std::optional<cv::Point2f>> corners;  ///< by id
  BoardDescription::Layout layout = BoardDescription::Layout::automatic;
  int markers = 0;                           ///< of the dictionary that were read
  int old_markers = 0, current_markers = 0;  ///< of those, how many lie where each layout has them

  int agreeing() const { return layout == BoardDescription::Layout::old ? old_markers : current_markers; }
};
CharucoCorners find_charuco(cv::Mat1b const& gray, BoardDescription const& board);

}  // namespace scanview
