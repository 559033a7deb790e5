#include "calib/board_detect.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "base/median.h"
#include "calib/board_refine.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Kind = BoardDescription::Kind;
using Layout = BoardDescription::Layout;

constexpr int kMidSide = 1000;  // pixels: larger pictures are searched at this size first, which is quick and robust

Vector2d to_eigen(cv::Point2f const& p) { return {static_cast<double>(p.x), static_cast<double>(p.y)}; }

cv::Mat1f to_gray(cv::Mat const& picture) {
  if (picture.empty() || (picture.depth() != CV_8U && picture.depth() != CV_16U))
    throw Error(ErrorCode::bad_input, {}, "a picture of a board has 8 or 16 bits");
  cv::Mat gray = picture;
  if (picture.channels() == 3) cv::cvtColor(picture, gray, cv::COLOR_BGR2GRAY);
  if (picture.channels() == 4) cv::cvtColor(picture, gray, cv::COLOR_BGRA2GRAY);
  cv::Mat1f result;
  gray.convertTo(result, CV_32F, picture.depth() == CV_16U ? 1.0 / 257 : 1.0);
  return result;
}

// 8 bits, its darkest and brightest hundredth at the ends: dark 16-bit pictures keep their steps.
cv::Mat1b stretched(cv::Mat1f const& gray) {
  std::vector<float> sample;
  for (int y = 0; y < gray.rows; y += 3)
    for (int x = 0; x < gray.cols; x += 3) sample.push_back(gray(y, x));
  auto const quantile = [&](double q) {
    auto const at = sample.begin() + static_cast<std::ptrdiff_t>(q * static_cast<double>(sample.size() - 1));
    std::nth_element(sample.begin(), at, sample.end());
    return static_cast<double>(*at);
  };
  double const low = quantile(0.005), high = std::max(quantile(0.995), low + 1);
  cv::Mat1b result;
  gray.convertTo(result, CV_8U, 255 / (high - low), -255 * low / (high - low));
  return result;
}

std::vector<cv::Point2f> search_chessboard(cv::Mat1b const& gray, cv::Size size, bool sectors) {
  std::vector<cv::Point2f> corners;
  bool const found = sectors ? cv::findChessboardCornersSB(gray, size, corners, cv::CALIB_CB_NORMALIZE_IMAGE)
                             : cv::findChessboardCorners(gray, size, corners,
                                                         cv::CALIB_CB_ADAPTIVE_THRESH | cv::CALIB_CB_NORMALIZE_IMAGE);
  if (!found || corners.size() != static_cast<std::size_t>(size.area())) corners.clear();
  return corners;
}

// Position as a quadratic of the board's plane, about one corner, from the corners around it. Without enough of them
// the warp is linear or not there at all.
struct LocalFit {
  Eigen::Matrix<double, 6, 2> terms = Eigen::Matrix<double, 6, 2>::Zero();  // 1, u, v, u², uv, v²
  bool usable = false;
  Vector2d operator()(Vector2d const& s) const {
    Eigen::Matrix<double, 6, 1> row;
    row << 1, s.x(), s.y(), s.x() * s.x(), s.x() * s.y(), s.y() * s.y();
    return terms.transpose() * row;
  }
};

using Grid = std::vector<std::optional<Vector2d>>;  // by id

LocalFit fit_around(Grid const& grid, BoardDescription const& board, int id) {
  int const columns = board.corner_columns(), rows = board.corner_rows();
  int const cx = id % columns, cy = id / columns;
  std::vector<std::array<double, 2>> places;
  std::vector<Vector2d> pixels;
  int span_x = 0, span_y = 0;
  for (int y = std::max(0, cy - 2); y <= std::min(rows - 1, cy + 2); ++y)
    for (int x = std::max(0, cx - 2); x <= std::min(columns - 1, cx + 2); ++x)
      if (auto const& p = grid[static_cast<std::size_t>(y * columns + x)]; p) {
        places.push_back({static_cast<double>(x - cx), static_cast<double>(y - cy)});
        pixels.push_back(*p);
        span_x |= 1 << (x - cx + 2);
        span_y |= 1 << (y - cy + 2);
      }
  int const wide = std::popcount(static_cast<unsigned>(span_x)), high = std::popcount(static_cast<unsigned>(span_y));
  LocalFit fit;
  auto const count = static_cast<Eigen::Index>(places.size());
  bool const quadratic = wide >= 3 && high >= 3 && count >= 9;
  if (!quadratic && (wide < 2 || high < 2 || count < 4)) return fit;
  Eigen::Index const unknowns = quadratic ? 6 : 3;
  Eigen::MatrixXd design(count, unknowns), seen(count, 2);
  for (Eigen::Index i = 0; i < count; ++i) {
    auto const [u, v] = places[static_cast<std::size_t>(i)];
    Eigen::Matrix<double, 1, 6> row;
    row << 1, u, v, u * u, u * v, v * v;
    design.row(i) = row.head(unknowns);
    seen.row(i) = pixels[static_cast<std::size_t>(i)].transpose();
  }
  auto const solver = design.colPivHouseholderQr();
  if (solver.rank() < unknowns) return fit;
  fit.terms.topRows(unknowns) = solver.solve(seen);
  fit.usable = fit.terms.allFinite();
  return fit;
}

CornerFitOptions fit_options(BoardDescription const& board, double square_px) {
  CornerFitOptions options;
  if (board.kind != Kind::charuco) return options;
  // Markers fill the bright squares up to their margin; half a pixel and the blur stay clear of them.
  double const margin = (1 - board.marker / board.square) / 2;
  options.clear_squares = std::max(margin - 1.2 / square_px, std::min(margin, 1.5 / square_px));
  return options;
}

struct Refined {
  Grid grid;
  std::vector<CornerFit> fits;
  double square_px = 0;
};

double square_in_pixels(Grid const& grid, BoardDescription const& board) {
  std::vector<double> sides;
  int const columns = board.corner_columns();
  for (int id = 0; id + 1 < board.corner_count(); ++id) {
    auto const &a = grid[static_cast<std::size_t>(id)], &b = grid[static_cast<std::size_t>(id) + 1];
    if ((id + 1) % columns != 0 && a && b) sides.push_back((*b - *a).norm());
    if (id + columns >= board.corner_count()) continue;
    auto const& below = grid[static_cast<std::size_t>(id + columns)];
    if (a && below) sides.push_back((*below - *a).norm());
  }
  return sides.empty() ? 0 : median(sides);
}

// Twice: the second time edges are straightened by what the first time found.
Refined refine(cv::Mat1f const& gray, BoardDescription const& board, Grid start) {
  Refined result;
  result.grid = std::move(start);
  result.square_px = square_in_pixels(result.grid, board);
  CornerFitOptions options = fit_options(board, result.square_px);
  for (bool const curved : {false, true}) {
    options.curved = curved;
    Grid const before = result.grid;
    result.fits.assign(before.size(), {});
    for (int id = 0; id < board.corner_count(); ++id) {
      auto const at = static_cast<std::size_t>(id);
      result.grid[at].reset();
      if (!before[at]) continue;
      LocalFit local = fit_around(before, board, id);
      if (!local.usable) continue;
      local.terms.row(0) = before[at]->transpose();
      CornerFit const fit = fit_corner(gray, local, options);
      result.fits[at] = fit;
      if (fit.usable) result.grid[at] = fit.pixel;
    }
  }
  return result;
}

// The colour of the square to the upper left of corner 0 tells a board from itself turned, where columns + rows are
// odd. A positive contrast at corner 0 means dark there: the fit's edges point right and down, and its product of
// distances is negative in the upper left.
bool turned(Refined const& refined, BoardDescription const& board) {
  double vote = 0;
  for (int id = 0; id < board.corner_count(); ++id) {
    CornerFit const& fit = refined.fits[static_cast<std::size_t>(id)];
    int const parity = (id % board.corner_columns() + id / board.corner_columns()) % 2;
    if (fit.usable) vote += parity == 0 ? fit.contrast : -fit.contrast;
  }
  return (board.corner_columns() + board.corner_rows()) % 2 == 1 && vote < 0;
}

// The saddle's contrast alternates over a chessboard: a corner that does not is none.
std::size_t wrong_contrasts(Refined const& refined, BoardDescription const& board) {
  std::size_t positive = 0, negative = 0;
  for (int id = 0; id < board.corner_count(); ++id) {
    CornerFit const& fit = refined.fits[static_cast<std::size_t>(id)];
    if (!fit.usable) continue;
    int const parity = (id % board.corner_columns() + id / board.corner_columns()) % 2;
    ((fit.contrast > 0) == (parity == 0) ? positive : negative) += 1;
  }
  return std::min(positive, negative);
}

// A finder may be content with a part of a larger board. Then a corner like the others follows beyond the outermost.
bool continues(cv::Mat1f const& gray, Refined const& refined, BoardDescription const& board) {
  int const columns = board.corner_columns(), rows = board.corner_rows();
  CornerFitOptions options = fit_options(board, refined.square_px);
  options.reach_squares = 0.3;
  auto const beyond = [&](int count, auto&& at, auto&& step) {
    int like = 0, tried = 0;
    for (int i = 0; i < count; ++i) {
      int const id = at(i);
      LocalFit const local = fit_around(refined.grid, board, id);
      CornerFit const& inner = refined.fits[static_cast<std::size_t>(id)];
      if (!local.usable || !inner.usable) continue;
      Vector2d const next = local(step);
      if (!(next.x() > 8 && next.y() > 8 && next.x() < gray.cols - 8 && next.y() < gray.rows - 8)) continue;
      ++tried;
      CornerFit const fit = fit_corner(
          gray, [&](Vector2d const& s) { return local(s + step); }, options);
      if (fit.usable && fit.contrast * inner.contrast < 0 && std::abs(fit.contrast) > 0.5 * std::abs(inner.contrast) &&
          fit.residual < 0.35 * std::abs(fit.contrast) && (fit.pixel - next).norm() < 0.2 * refined.square_px)
        ++like;
    }
    return tried > 0 && 4 * like >= 3 * tried;
  };
  return beyond(
             columns, [&](int i) { return i; }, Vector2d(0, -1)) ||
         beyond(
             columns, [&](int i) { return (rows - 1) * columns + i; }, Vector2d(0, 1)) ||
         beyond(
             rows, [&](int i) { return i * columns; }, Vector2d(-1, 0)) ||
         beyond(
             rows, [&](int i) { return i * columns + columns - 1; }, Vector2d(1, 0));
}

std::vector<BoardCorner> corners_of(Refined const& refined) {
  std::vector<BoardCorner> corners;
  for (std::size_t id = 0; id < refined.grid.size(); ++id)
    if (refined.grid[id]) corners.push_back({static_cast<int>(id), refined.fits[id].pixel, refined.fits[id].sigma_px});
  return corners;
}

DetectedBoard detect_chessboard(cv::Mat1f const& gray, BoardDescription const& board) {
  DetectedBoard result;
  auto const points = find_chessboard(stretched(gray), board);
  if (points.empty()) {
    result.why = fmt::format("no chessboard of {} inner corners was found", board.name());
    return result;
  }
  Grid grid;
  for (cv::Point2f const& p : points) grid.emplace_back(to_eigen(p));
  Refined const refined = refine(gray, board, std::move(grid));
  std::vector<BoardCorner> corners = corners_of(refined);
  if (corners.size() != points.size() || wrong_contrasts(refined, board) > 0) {
    result.why = fmt::format("{} of the {} corners that the finder gave are not like a chessboard's",
                             points.size() - corners.size() + wrong_contrasts(refined, board), points.size());
    return result;
  }
  if (continues(gray, refined, board)) {
    result.why = fmt::format("the board continues beyond {} inner corners: it is larger", board.name());
    return result;
  }
  if (turned(refined, board)) {
    for (BoardCorner& corner : corners) corner.id = board.corner_count() - 1 - corner.id;
    std::reverse(corners.begin(), corners.end());
  }
  result.corners = std::move(corners);
  return result;
}

// Corners whose colours are not those of the layout, or whose place the neighbours do not expect, go.
std::vector<BoardCorner> checked_charuco(Refined const& refined, BoardDescription const& board, Layout layout) {
  bool const first_bright = layout == Layout::old && board.rows % 2 == 0;
  std::vector<double> contrasts, sigmas;
  for (CornerFit const& fit : refined.fits) {
    if (!fit.usable) continue;
    contrasts.push_back(std::abs(fit.contrast));
    sigmas.push_back(fit.sigma_px);
  }
  if (contrasts.empty()) return {};
  double const contrast = median(contrasts), sigma = median(sigmas);
  std::vector<BoardCorner> corners;
  for (BoardCorner const& corner : corners_of(refined)) {
    CornerFit const& fit = refined.fits[static_cast<std::size_t>(corner.id)];
    int const parity = (corner.id % board.corner_columns() + corner.id / board.corner_columns()) % 2;
    bool const bright = (parity == 0) == first_bright;  // the square to the upper left
    if ((fit.contrast < 0) == bright && std::abs(fit.contrast) > 0.3 * contrast &&
        fit.residual < 0.35 * std::abs(fit.contrast) && fit.sigma_px < 6 * sigma)
      corners.push_back(corner);
  }
  return corners;
}

DetectedBoard detect_charuco(cv::Mat1f const& gray, BoardDescription const& board) {
  constexpr std::size_t kFewest = 6;
  DetectedBoard result;
  cv::Mat1b const picture = stretched(gray);
  CharucoCorners const found = find_charuco(picture, board);
  result.layout = found.layout;
  result.old_markers = found.old_markers;
  result.current_markers = found.current_markers;
  Grid grid;
  for (auto const& p : found.corners) grid.push_back(p ? std::optional<Vector2d>(to_eigen(*p)) : std::nullopt);
  result.corners = checked_charuco(refine(gray, board, std::move(grid)), board, found.layout);
  if (result.corners.size() >= kFewest) return result;
  result.corners.clear();
  cv::Mat1b mirror;
  cv::flip(picture, mirror, 1);
  if (find_charuco(mirror, board).agreeing() > 3 * std::max(1, found.agreeing()))
    result.why = "its markers can be read in a mirror only: the picture is flipped";
  else if (found.markers == 0)
    result.why = fmt::format("no marker of {} was read", board.dictionary);
  else
    result.why = fmt::format("{} markers were read, but only {} lie where {} has them", found.markers, found.agreeing(),
                             board.name());
  return result;
}

}  // namespace

std::vector<cv::Point2f> find_chessboard(cv::Mat1b const& gray, BoardDescription const& board) {
  cv::Size const size(board.columns, board.rows);
  double const side = std::max(gray.cols, gray.rows);
  // Sizes to look at: as it is, smaller where it is large (defocused and finely textured pictures), larger where small.
  std::vector<double> scales = {1};
  if (side > 1.3 * kMidSide) scales.insert(scales.begin(), kMidSide / side);
  if (side <= 1.3 * kMidSide) scales.push_back(side > kMidSide / 2 ? 0.5 : 2);
  for (bool const sectors : {false, true})
    for (double const scale : scales) {
      cv::Mat1b picture = gray;
      if (scale != 1) cv::resize(gray, picture, {}, scale, scale, scale < 1 ? cv::INTER_AREA : cv::INTER_CUBIC);
      std::vector<cv::Point2f> corners = search_chessboard(picture, size, sectors);
      if (corners.empty()) continue;
      for (cv::Point2f& p : corners)
        p = (p + cv::Point2f(0.5F, 0.5F)) / static_cast<float>(scale) - cv::Point2f(0.5F, 0.5F);
      // A finder may count along any side: seen from the printed side, rows follow columns clockwise.
      auto const at = [&](int x, int y) { return to_eigen(corners[static_cast<std::size_t>(y * size.width + x)]); };
      Vector2d const right = at(size.width - 1, 0) - at(0, 0), down = at(0, size.height - 1) - at(0, 0);
      if (right.x() * down.y() - right.y() * down.x() < 0)
        for (int y = 0; y < size.height; ++y)
          std::reverse(corners.begin() + y * size.width, corners.begin() + (y + 1) * size.width);
      return corners;
    }
  return {};
}

DetectedBoard detect_board(cv::Mat const& picture, BoardDescription const& board) {
  board.validate();
  cv::Mat1f const gray = to_gray(picture);
  return board.kind == Kind::charuco ? detect_charuco(gray, board) : detect_chessboard(gray, board);
}

}  // namespace scanview
