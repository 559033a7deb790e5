#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <opencv2/aruco.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

#include "base/error.h"
#include "calib/board_detect.h"

namespace scanview {
namespace {

using Layout = BoardDescription::Layout;

std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME> const& dictionaries() {
  static std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME> const all = [] {
    std::map<std::string, cv::aruco::PREDEFINED_DICTIONARY_NAME> names;
    // OpenCV numbers them by side (4 to 7 cells), then by count.
    constexpr std::array kCounts = {50, 100, 250, 1000};
    int number = cv::aruco::DICT_4X4_50;
    for (int side = 4; side <= 7; ++side)
      for (int const count : kCounts)
        names[fmt::format("DICT_{0}X{0}_{1}", side, count)] =
            static_cast<cv::aruco::PREDEFINED_DICTIONARY_NAME>(number++);
    names["DICT_ARUCO_ORIGINAL"] = cv::aruco::DICT_ARUCO_ORIGINAL;
    names["DICT_APRILTAG_16h5"] = cv::aruco::DICT_APRILTAG_16h5;
    names["DICT_APRILTAG_25h9"] = cv::aruco::DICT_APRILTAG_25h9;
    names["DICT_APRILTAG_36h10"] = cv::aruco::DICT_APRILTAG_36h10;
    names["DICT_APRILTAG_36h11"] = cv::aruco::DICT_APRILTAG_36h11;
    return names;
  }();
  return all;
}

cv::Ptr<cv::aruco::Dictionary> find_dictionary(std::string const& name) {
  auto const found = dictionaries().find(name);
  if (found == dictionaries().end())
    throw Error(ErrorCode::usage, {},
                fmt::format("'{}' is no dictionary of OpenCV (as DICT_4X4_50 to DICT_7X7_1000, DICT_ARUCO_ORIGINAL, "
                            "DICT_APRILTAG_36h11)",
                            name));
  return cv::aruco::getPredefinedDictionary(found->second);
}

// The four corners of each marker on the board (same plane and unit as BoardDescription::corner), clockwise from its
// top left, by marker id.
using MarkerPlaces = std::vector<std::array<cv::Point2f, 4>>;

MarkerPlaces marker_places(BoardDescription const& board, Layout layout) {
  bool const marker_first = layout == Layout::old && board.rows % 2 == 0;  // a marker in the top-left square
  MarkerPlaces places;
  for (int y = 0; y < board.rows; ++y)
    for (int x = 0; x < board.columns; ++x) {
      if (((x + y) % 2 == 0) != marker_first) continue;
      // The first corner lies one square in from the board's outline.
      double const middle_x = (x - 0.5) * board.square, middle_y = (y - 0.5) * board.square, half = board.marker / 2;
      std::array<cv::Point2f, 4> place;
      for (std::size_t k = 0; k < 4; ++k)
        place[k] = cv::Point2f(static_cast<float>(middle_x + (k == 1 || k == 2 ? half : -half)),
                               static_cast<float>(middle_y + (k >= 2 ? half : -half)));
      places.push_back(place);
    }
  return places;
}

// What was read in one picture.
struct Markers {
  std::vector<int> ids;
  std::vector<std::vector<cv::Point2f>> corners;
};

struct Agreement {
  std::vector<std::size_t> markers;  // indices that lie where the layout has them
  cv::Mat homography;
};

// The largest set of markers that one homography puts in place. Lenses bend, so half a square is allowed.
Agreement agree(Markers const& markers, MarkerPlaces const& places, double square) {
  std::vector<cv::Point2f> on_board, in_picture;
  std::vector<std::size_t> candidates;
  for (std::size_t i = 0; i < markers.ids.size(); ++i) {
    if (markers.ids[i] < 0 || static_cast<std::size_t>(markers.ids[i]) >= places.size()) continue;
    candidates.push_back(i);
    for (std::size_t k = 0; k < 4; ++k) {
      on_board.push_back(places[static_cast<std::size_t>(markers.ids[i])][k]);
      in_picture.push_back(markers.corners[i][k]);
    }
  }
  Agreement result;
  if (candidates.size() < 2) return result;
  // From the picture to the board, so that the threshold is in squares.
  std::vector<uchar> inliers;
  result.homography = cv::findHomography(in_picture, on_board, cv::RANSAC, 0.3 * square, inliers, 2000, 0.999);
  if (result.homography.empty()) return result;
  for (std::size_t i = 0; i < candidates.size(); ++i)
    if (inliers[4 * i] && inliers[4 * i + 1] && inliers[4 * i + 2] && inliers[4 * i + 3])
      result.markers.push_back(candidates[i]);
  return result;
}

Markers read_markers(cv::Mat1b const& gray, BoardDescription const& board) {
  auto const parameters = cv::aruco::DetectorParameters::create();
  parameters->cornerRefinementMethod = cv::aruco::CORNER_REFINE_SUBPIX;
  // Markers stand close: their outline must not be smoothed over the gap, nor found twice be taken for two.
  parameters->cornerRefinementWinSize = 2;
  parameters->minMarkerPerimeterRate = 0.01;
  parameters->minMarkerDistanceRate = 0.02;
  parameters->adaptiveThreshWinSizeMax = 33;
  Markers markers;
  cv::aruco::detectMarkers(gray, find_dictionary(board.dictionary), markers.corners, markers.ids, parameters);
  return markers;
}

// Corners by the homography of the markers around each: at least one that touches it, and three in all.
void place_corners(Markers const& markers, Agreement const& agreement, MarkerPlaces const& places,
                   BoardDescription const& board, CharucoCorners& result) {
  for (int id = 0; id < board.corner_count(); ++id) {
    Eigen::Vector2d const corner = board.corner(id);
    cv::Point2f const at(static_cast<float>(corner.x()), static_cast<float>(corner.y()));
    std::vector<cv::Point2f> on_board, in_picture;
    bool touching = false;
    for (std::size_t const i : agreement.markers) {
      auto const& place = places[static_cast<std::size_t>(markers.ids[i])];
      cv::Point2f const away = (place[0] + place[2]) / 2 - at;
      double const squares = std::max(std::abs(away.x), std::abs(away.y)) / board.square;
      touching = touching || squares < 0.6;
      if (squares > 2.1) continue;
      on_board.insert(on_board.end(), place.begin(), place.end());
      in_picture.insert(in_picture.end(), markers.corners[i].begin(), markers.corners[i].end());
    }
    if (!touching || on_board.size() < 12) continue;
    cv::Mat const local = cv::findHomography(on_board, in_picture, 0);
    if (local.empty()) continue;
    std::vector<cv::Point2f> seen;
    cv::perspectiveTransform(std::vector<cv::Point2f>{at}, seen, local);
    if (std::isfinite(seen[0].x) && std::isfinite(seen[0].y)) result.corners[static_cast<std::size_t>(id)] = seen[0];
  }
}

}  // namespace

CharucoCorners find_charuco(cv::Mat1b const& gray, BoardDescription const& board) {
  CharucoCorners result;
  result.corners.resize(static_cast<std::size_t>(board.corner_count()));
  Markers const markers = read_markers(gray, board);
  result.markers = static_cast<int>(markers.ids.size());
  Agreement best;
  std::vector<Layout> candidates = {Layout::current, Layout::old};
  if (board.layout != Layout::automatic) candidates = {board.layout};
  for (Layout const layout : candidates) {
    Agreement agreement = agree(markers, marker_places(board, layout), board.square);
    (layout == Layout::old ? result.old_markers : result.current_markers) = static_cast<int>(agreement.markers.size());
    if (agreement.markers.size() <= best.markers.size()) continue;
    best = std::move(agreement);
    result.layout = layout;
  }
  if (best.markers.size() >= 3) place_corners(markers, best, marker_places(board, result.layout), board, result);
  return result;
}

}  // namespace scanview
