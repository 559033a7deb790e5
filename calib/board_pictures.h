#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "calib/calibrate.h"

namespace scanview {

/// The pictures of one moment; an empty path where a camera has none.
struct PicturePair {
  std::string name;  ///< the left file's (otherwise the right file's), without its folder
  std::filesystem::path left, right;
};

/// Files that patterns name, sorted: each a file, a folder (all pictures in it) or a shell pattern (`*`, `?`, `[]`).
/// Throws Error{bad_input} for one that names nothing.
std::vector<std::filesystem::path> find_pictures(std::vector<std::string> const& patterns);

/// Pairs by the last number in the files' names where each has its own; otherwise in sorted order. Throws Error{usage}
/// where there is no such number and the counts differ. `unpaired` says in words which have no partner.
struct PicturePairs {
  std::vector<PicturePair> pairs;
  std::vector<std::string> unpaired;
};
PicturePairs pair_pictures(std::vector<std::filesystem::path> const& left,
                           std::vector<std::filesystem::path> const& right);

/// The boards in all pictures, detected in parallel.
struct BoardPictures {
  std::vector<BoardView> views;                  ///< in the pairs' order
  std::vector<NamedReason> left_why, right_why;  ///< pictures without a board
  cv::Size left_size, right_size;                ///< of the pictures that show one
  BoardDescription board;                        ///< with the layout that was recognised
};

/// Throws Error{bad_input} naming a picture that cannot be read, or one with a board whose size is not that of the
/// others of its camera.
BoardPictures detect_boards(std::vector<PicturePair> const& pairs, BoardDescription const& board, Context& context);

}  // namespace scanview
