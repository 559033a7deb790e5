#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "acquire/code_image.h"
#include "acquire/rectification.h"
#include "base/context.h"

namespace scanview {

/// Where a code is on a row, and how well.
struct CodePlace {
  float x = 0;
  float slope = 0;       ///< |d code / dx| there
  float sigma = 0;       ///< of the code there, from noise
  float bias = 0;        ///< what the code there may be off by besides
  bool is_leap = false;  ///< between two pixels that are not linked: a surface seen at a grazing angle, or a step
};

/// The codes of a rectified picture, ready to be looked up row by row: the code is linear between two linked pixels,
/// and half a pixel beyond the last one of a surface; between pixels that are not linked a place is a leap.
class CodeRows {
 public:
  static constexpr int kMostPlaces = 6;
  struct Places {
    std::array<CodePlace, kMostPlaces> place;
    int count = 0;
    bool overflow = false;  ///< there are more
  };
  CodeRows() = default;
  CodeRows(CodeImage rectified, Context& context);
  int rows() const { return image_.code.rows; }
  CodeImage const& image() const { return image_; }
  /// Change of the code along a row over that from row to row; infinite where it does not change from row to row.
  /// Near 0 the light runs along the rows, and a place on a row says nothing.
  double change_along_rows() const { return change_along_rows_; }
  /// All places of a code on a row, from left to right. About two comparisons.
  Places find(int row, float code) const;

 private:
  /// From pixel `x` to the next, or half a pixel before or beyond it.
  enum class Kind : std::uint8_t { between, before, after, leap };
  struct Piece {
    std::uint16_t x;
    Kind kind;
  };
  struct Row {
    std::vector<std::uint32_t> first;  // of each bucket of codes
    std::vector<Piece> pieces;
  };
  struct Ends {
    float from, to, code_from, code_to;
  };
  Ends ends(int row, Piece piece) const;
  Row index_row(int y) const;

  CodeImage image_;
  cv::Mat1b linked_;
  std::vector<Row> rows_;
  float low_ = 0, buckets_per_code_ = 1, most_leap_ = 0;
  int buckets_ = 0;
  double change_along_rows_ = 0;
};

/// Whether most pixels of a surface have a code, or only those on lines a pixel wide (the stripe decoder).
enum class CodeDensity { surfaces, lines };

struct MatchFigures {
  std::size_t decodable = 0;  ///< left pixels with a code
  std::size_t ambiguous = 0;  ///< of them with several partners that may be right
  double sheet_scatter = 0;   ///< of matches about the light's geometry, in codes; 0: it could not be told
};

/// Depth of every pixel of the ideal left camera: its code is looked up on its epipolar line in the right camera. Of
/// several partners the one counts whose place agrees with the sheet of light that the view's unambiguous matches tell
/// of (light_sheets.h); a partner that does not agree is none. Where the light's geometry cannot be told, a partner
/// counts whose own partner on the left is this pixel alone, or, where there are rivals, one whose disparity is within
/// `kNear` pixels of what the surroundings agree on; else the pixel is inconsistent. Depths that fewer than three of
/// the eight neighbours support (two where codes are lines) go, too.
///
/// `left` are the codes on the grid of the ideal left camera (see resample), `right_rows` on the right rectified one;
/// `left_rows(step)` makes every so many rows of the left rectified one: every third tells where the light was, and all
/// are asked for only where that cannot be told. sigma = depth · Z / (f · baseline) · sqrt(sigma_left² + sigma_right²)
/// / |d code / dx|, Z the depth in the rectified frame.
RangeImage match_codes(CodeImage const& left, std::function<CodeRows(int step)> const& left_rows,
                       CodeRows const& right_rows, Rectification const& rectification, Camera const& camera,
                       CodeDensity density, MatchFigures& figures, Context& context);

}  // namespace scanview
