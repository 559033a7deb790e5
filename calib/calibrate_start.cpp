#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <optional>

#include "calib/calibrate_problem.h"

namespace scanview {
namespace {

using Eigen::Vector2d;

// One camera as OpenCV sees it.
struct CameraStart {
  cv::Mat1d matrix, distortion;
  std::vector<std::optional<Eigen::Isometry3d>> camera_from_board;
};

Eigen::Isometry3d to_isometry(cv::Mat const& rotation, cv::Mat const& translation) {
  cv::Mat1d matrix;
  cv::Rodrigues(rotation, matrix);
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) pose.linear()(i, j) = matrix(i, j);
    pose.translation()[i] = translation.at<double>(i);
  }
  return pose;
}

struct Points {
  std::vector<cv::Point3f> on_board;
  std::vector<cv::Point2f> in_picture;
};

Points to_points(std::vector<BoardCorner> const& corners, BoardDescription const& board) {
  Points points;
  for (BoardCorner const& corner : corners) {
    Vector2d const p = board.corner(corner.id);
    points.on_board.emplace_back(static_cast<float>(p.x()), static_cast<float>(p.y()), 0.0F);
    points.in_picture.emplace_back(static_cast<float>(corner.pixel.x()), static_cast<float>(corner.pixel.y()));
  }
  return points;
}

bool plausible(cv::Mat1d const& matrix, cv::Size size) {
  double const side = std::max(size.width, size.height);
  for (int const k : {0, 1})
    if (!(matrix(k, k) > 0.1 * side && matrix(k, k) < 100 * side)) return false;
  return std::isfinite(matrix(0, 2)) && std::isfinite(matrix(1, 2));
}

// Where OpenCV finds nothing sensible (boards all parallel to the picture), a usual lens: the solve then says what is
// open.
void usual_lens(CameraStart& start, cv::Size size) {
  double const focal = 1.2 * std::max(size.width, size.height);
  start.matrix = (cv::Mat1d(3, 3) << focal, 0, (size.width - 1) / 2.0, 0, focal, (size.height - 1) / 2.0, 0, 0, 1);
  start.distortion = cv::Mat1d::zeros(1, 5);
}

std::optional<Eigen::Isometry3d> solve_pnp(Points const& points, cv::Mat const& matrix, cv::Mat const& distortion) {
  if (points.on_board.size() < 4) return std::nullopt;
  try {
    cv::Mat rotation, translation;
    if (cv::solvePnP(points.on_board, points.in_picture, matrix, distortion, rotation, translation, false,
                     cv::SOLVEPNP_ITERATIVE) &&
        translation.at<double>(2) > 0)
      return to_isometry(rotation, translation);
  } catch (cv::Exception const&) {
  }
  return std::nullopt;
}

CameraStart start_camera(std::vector<std::vector<BoardCorner> const*> const& views, BoardDescription const& board,
                         cv::Size size) {
  constexpr std::size_t kFewest = 6;
  CameraStart start;
  start.camera_from_board.resize(views.size());
  std::vector<Points> points;
  std::vector<std::vector<cv::Point3f>> on_board;
  std::vector<std::vector<cv::Point2f>> in_picture;
  for (auto const* const view : views) {
    points.push_back(to_points(*view, board));
    if (view->size() < kFewest) continue;
    on_board.push_back(points.back().on_board);
    in_picture.push_back(points.back().in_picture);
  }
  bool good = false;
  try {
    std::vector<cv::Mat> rotations, translations;
    cv::Mat matrix, distortion;
    cv::calibrateCamera(on_board, in_picture, size, matrix, distortion, rotations, translations,
                        cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST);
    start.matrix = matrix;
    start.distortion = cv::Mat1d::zeros(1, 5);
    for (int k = 0; k < 2; ++k) start.distortion(k) = distortion.at<double>(k);
    good = plausible(start.matrix, size) && cv::norm(start.distortion) < 100;
  } catch (cv::Exception const&) {
  }
  if (!good) usual_lens(start, size);
  for (std::size_t i = 0; i < views.size(); ++i) {
    start.camera_from_board[i] = solve_pnp(points[i], start.matrix, start.distortion);
  }
  return start;
}

void take_lens(CameraStart const& start, int at, SharedVector& shared) {
  cv::Mat1d const& m = start.matrix;
  shared.segment<4>(at) << m(0, 0), m(1, 1), m(0, 2), m(1, 2);
  for (int k = 0; k < 5; ++k) shared[at + 4 + k] = start.distortion(k);
}

// How many pixels apart, in the right picture, two rigs put a board.
double disagreement(Eigen::Isometry3d const& a, Eigen::Isometry3d const& b, Eigen::Isometry3d const& left_from_board,
                    BoardDescription const& board, double focal) {
  double sum = 0;
  int const last = board.corner_count() - 1;
  std::array const ids = {0, board.corner_columns() - 1, last - board.corner_columns() + 1, last};
  for (int const id : ids) {
    Vector2d const corner = board.corner(id);
    Eigen::Vector3d const p = left_from_board * Eigen::Vector3d(corner.x(), corner.y(), 0);
    Eigen::Vector3d const in_a = a * p, in_b = b * p;
    if (!(in_a.z() > 0) || !(in_b.z() > 0)) return std::numeric_limits<double>::infinity();
    sum += focal * (in_a.head<2>() / in_a.z() - in_b.head<2>() / in_b.z()).norm();
  }
  return sum / static_cast<double>(ids.size());
}

// Ids of the same corners when the board lies turned by quarter turns.
int turned_id(int id, int quarters, BoardDescription const& board) {
  int const columns = board.corner_columns(), rows = board.corner_rows();
  int const x = id % columns, y = id / columns;
  switch (quarters) {
    case 1:
      return x * columns + (columns - 1 - y);  // square boards only
    case 2:
      return (rows - 1 - y) * columns + (columns - 1 - x);
    case 3:
      return (rows - 1 - x) * columns + y;
    default:
      return id;
  }
}

}  // namespace

std::optional<Eigen::Isometry3d> pose_before(LensCamera const& camera, std::vector<BoardCorner> const& corners,
                                             BoardDescription const& board) {
  Camera const& c = camera.camera;
  Lens const& l = camera.lens;
  return solve_pnp(to_points(corners, board), cv::Mat(cv::Matx33d(c.fx(), 0, c.cx(), 0, c.fy(), c.cy(), 0, 0, 1)),
                   cv::Mat(cv::Matx<double, 1, 5>(l.k1, l.k2, l.p1, l.p2, l.k3)));
}

void align_turns(std::vector<BoardView>& views, BoardDescription const& board) {
  if (board.kind != BoardDescription::Kind::chessboard) return;
  int const columns = board.corner_columns(), rows = board.corner_rows();
  std::vector<int> turns = {0};
  if (columns == rows)
    turns = {0, 1, 2, 3};
  else if ((columns + rows) % 2 == 0)
    turns = {0, 2};
  if (turns.size() == 1) return;
  auto const count = static_cast<std::size_t>(board.corner_count());
  for (BoardView& view : views) {
    if (view.left.size() != count || view.right.size() != count) continue;
    // Cameras of a rig are mounted alike: the turn that makes the board's sides point alike.
    auto const side = [&](std::vector<BoardCorner> const& corners, int a, int b) -> Vector2d {
      return (corners[static_cast<std::size_t>(b)].pixel - corners[static_cast<std::size_t>(a)].pixel).normalized();
    };
    int best = 0;
    double best_score = -std::numeric_limits<double>::infinity();
    for (int const turn : turns) {
      std::vector<BoardCorner> corners = view.right;
      for (BoardCorner const& corner : view.right)
        corners[static_cast<std::size_t>(turned_id(corner.id, turn, board))] = corner;
      double score = 0;
      for (auto const& [a, b] : {std::pair{0, columns - 1}, {0, columns * (rows - 1)}})
        score += side(view.left, a, b).dot(side(corners, a, b));
      if (score <= best_score) continue;
      best_score = score;
      best = turn;
    }
    for (BoardCorner& corner : view.right) corner.id = turned_id(corner.id, best, board);
    std::sort(view.right.begin(), view.right.end(),
              [](BoardCorner const& a, BoardCorner const& b) { return a.id < b.id; });
  }
}

std::vector<BoardCorner> mirrored(std::vector<BoardCorner> corners, BoardDescription const& board, int width) {
  int const columns = board.corner_columns();
  for (BoardCorner& corner : corners) {
    corner.pixel.x() = width - 1 - corner.pixel.x();
    // The colours' rule fixes one end of the board; mirroring across its length keeps that end.
    int const x = corner.id % columns, y = corner.id / columns;
    corner.id =
        board.corner_columns() % 2 == 0 ? (columns - 1 - x) + y * columns : x + (board.corner_rows() - 1 - y) * columns;
  }
  std::sort(corners.begin(), corners.end(), [](BoardCorner const& a, BoardCorner const& b) { return a.id < b.id; });
  return corners;
}

Start start_values(std::vector<BoardView> const& views, CalibrateOptions const& options) {
  std::vector<std::vector<BoardCorner> const*> lefts, rights;
  bool any_right = false;
  for (BoardView const& view : views) {
    lefts.push_back(&view.left);
    rights.push_back(&view.right);
    any_right = any_right || !view.right.empty();
  }
  Start start;
  start.estimate.poses.resize(views.size(), PoseVector::Zero());
  CameraStart const left = start_camera(lefts, options.board, options.left_size);
  take_lens(left, 0, start.estimate.shared);
  if (!any_right) {
    for (std::size_t i = 0; i < views.size(); ++i)
      if (left.camera_from_board[i]) start.estimate.poses[i] = to_vector(*left.camera_from_board[i]);
    return start;
  }
  CameraStart const right = start_camera(rights, options.board, options.right_size);
  take_lens(right, kRight, start.estimate.shared);

  // The rig of the board whose rig puts the other boards best, wrong ones not counting more than the limit.
  double const focal = right.matrix(0, 0);
  double const limit = 0.01 * std::hypot(options.right_size.width, options.right_size.height);
  std::vector<std::size_t> common;
  std::vector<Eigen::Isometry3d> rigs(views.size());
  for (std::size_t i = 0; i < views.size(); ++i)
    if (left.camera_from_board[i] && right.camera_from_board[i]) {
      common.push_back(i);
      rigs[i] = *right.camera_from_board[i] * left.camera_from_board[i]->inverse();
    }
  start.common = common.size();
  double best = std::numeric_limits<double>::infinity();
  Eigen::Isometry3d rig = Eigen::Isometry3d::Identity();
  for (std::size_t const i : common) {
    double sum = 0;
    std::size_t agreeing = 0;
    for (std::size_t const j : common) {
      double const apart = disagreement(rigs[i], rigs[j], *left.camera_from_board[j], options.board, focal);
      sum += std::min(apart, 10 * limit);
      agreeing += apart < limit ? 1 : 0;
    }
    if (sum >= best) continue;
    best = sum;
    rig = rigs[i];
    start.agreeing = agreeing;
  }
  start.estimate.shared.segment<6>(kRotation) = to_vector(rig);
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (left.camera_from_board[i])
      start.estimate.poses[i] = to_vector(*left.camera_from_board[i]);
    else if (right.camera_from_board[i])
      start.estimate.poses[i] = to_vector(rig.inverse() * *right.camera_from_board[i]);
  }
  return start;
}

}  // namespace scanview
