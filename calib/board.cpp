#include "calib/board.h"

#include <fmt/format.h>

#include <charconv>

#include "base/error.h"

namespace scanview {
namespace {

// A whole number that fills the text; 0 otherwise.
int whole_number(std::string_view text) {
  int value = 0;
  auto const [end, problem] = std::from_chars(text.data(), text.data() + text.size(), value);
  return problem == std::errc() && end == text.data() + text.size() ? value : 0;
}

}  // namespace

Eigen::Vector2d BoardDescription::corner(int id) const {
  return square * Eigen::Vector2d(id % corner_columns(), id / corner_columns());
}

std::string BoardDescription::name() const {
  return fmt::format("{}{}x{}", kind == Kind::charuco ? "charuco:" : "", columns, rows);
}

void BoardDescription::validate() const {
  constexpr int kMost = 200;
  auto const refuse = [](std::string const& why) { throw Error(ErrorCode::usage, {}, why); };
  int const least = kind == Kind::charuco ? 2 : 3;
  if (columns < least || rows < least || columns > kMost || rows > kMost || corner_count() < 6)
    refuse(fmt::format("a board of {} has no six corners, or has more than {} a side", name(), kMost));
  if (!(square > 0) || !std::isfinite(square)) refuse("the side of a square must be positive");
  if (kind == Kind::charuco && !(marker > 0 && marker < square))
    refuse("a ChArUco board needs the side of its markers, smaller than a square");
  if (kind == Kind::charuco && dictionary.empty()) refuse("a ChArUco board needs its dictionary, as DICT_5X5_1000");
}

BoardDescription parse_board(std::string const& text, double square, double marker, std::string const& dictionary) {
  constexpr std::string_view kCharuco = "charuco:";
  BoardDescription board;
  std::string_view sizes = text;
  if (sizes.starts_with(kCharuco)) {
    board.kind = BoardDescription::Kind::charuco;
    sizes.remove_prefix(kCharuco.size());
  }
  auto const cross = sizes.find('x');
  if (cross != std::string_view::npos) {
    board.columns = whole_number(sizes.substr(0, cross));
    board.rows = whole_number(sizes.substr(cross + 1));
  }
  if (cross == std::string_view::npos || board.columns < 1 || board.rows < 1)
    throw Error(ErrorCode::usage, {},
                fmt::format("'{}' is no board: 9x6 (inner corners) or charuco:25x18 (squares)", text));
  board.square = square;
  board.marker = marker;
  board.dictionary = dictionary;
  board.validate();
  return board;
}

std::string to_string(BoardDescription::Layout layout) {
  switch (layout) {
    case BoardDescription::Layout::old:
      return "old (OpenCV up to 4.5: marker 0 in the top-left square)";
    case BoardDescription::Layout::current:
      return "current (OpenCV 4.6 and later: the top-left square is black)";
    case BoardDescription::Layout::automatic:
      break;
  }
  return "automatic";
}

}  // namespace scanview
