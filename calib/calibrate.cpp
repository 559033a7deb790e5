#include "calib/calibrate.h"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "calib/calibrate_problem.h"
#include "calib/calibrate_reject.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Status = Calibration::Status;

constexpr std::size_t kFewestBoards = 3;
constexpr std::size_t kFewestCorners = 6;  // of a board in one picture

// Distortion terms in the order in which they are given up, as offsets into a lens' unknowns.
constexpr std::array kGivenUp = {8, 5, 7, 6, 4};  // k3 k2 p2 p1 k1

void check_views(std::vector<BoardView> const& views, CalibrateOptions const& options) {
  for (BoardView const& view : views)
    for (auto const& [corners, size] : {std::pair{&view.left, options.left_size}, {&view.right, options.right_size}}) {
      if (!corners->empty() && size.empty())
        throw Error(ErrorCode::usage, {}, fmt::format("{}: corners, but no picture size", view.name));
      for (BoardCorner const& corner : *corners)
        if (corner.id < 0 || corner.id >= options.board.corner_count() || !corner.pixel.allFinite() ||
            !(corner.sigma_px >= 0) || !std::isfinite(corner.sigma_px))
          throw Error(ErrorCode::usage, {}, fmt::format("{}: a corner is none of the board's", view.name));
    }
}

Problem make_problem(std::vector<BoardView> const& views, CalibrateOptions const& options) {
  Problem problem;
  problem.board_used.assign(views.size(), false);
  for (std::size_t i = 0; i < views.size(); ++i)
    for (Side const side : {Side::left, Side::right})
      for (BoardCorner const& corner : side == Side::left ? views[i].left : views[i].right) {
        problem.observations.push_back(
            {i, side, corner.id, options.board.corner(corner.id), corner.pixel, corner.sigma_px, true});
        problem.board_used[i] = true;
      }
  return problem;
}

// How many boards in use each camera saw, and both.
struct Counts {
  std::size_t left = 0, right = 0, common = 0, used = 0, seen = 0;
};

Counts count_boards(std::vector<BoardView> const& views, std::vector<bool> const& used) {
  Counts counts;
  for (std::size_t i = 0; i < views.size(); ++i) {
    bool const left = !views[i].left.empty(), right = !views[i].right.empty();
    counts.seen += left || right ? 1 : 0;
    if (!used[i]) continue;
    counts.left += left ? 1 : 0;
    counts.right += right ? 1 : 0;
    counts.common += left && right ? 1 : 0;
    counts.used += left || right ? 1 : 0;
  }
  return counts;
}

std::string too_few(Counts const& counts, bool stereo) {
  if (counts.left < kFewestBoards)
    return fmt::format("{} boards in the left pictures: a camera needs at least {}, tilted differently", counts.left,
                       kFewestBoards);
  if (stereo && counts.right < kFewestBoards)
    return fmt::format("{} boards in the right pictures: a camera needs at least {}, tilted differently", counts.right,
                       kFewestBoards);
  if (stereo && counts.common < kFewestBoards)
    return fmt::format("{} boards were seen by both cameras: a rig needs at least {}", counts.common, kFewestBoards);
  return {};
}

// Plain least squares on what is left, the noise estimated along.
void polish(Problem& problem, Estimate& estimate) {
  for (int round = 0; round < 3; ++round) {
    estimate_noise(problem, estimate, NoiseFrom::mean);
    solve(problem, estimate, {});
  }
}

// Standard deviation, in pixels, of the displacement by the lens at the picture's corner that is furthest out.
double corner_deviation(SharedMatrix const& covariance, Estimate const& estimate, Side side, cv::Size size) {
  int const at = side == Side::left ? 0 : kRight;
  auto const lens = estimate.shared.segment<kLensUnknowns>(at);
  double worst = 0;
  for (double const px : {-0.5, size.width - 0.5})
    for (double const py : {-0.5, size.height - 0.5}) {
      double const x = (px - lens[2]) / lens[0], y = (py - lens[3]) / lens[1], r2 = x * x + y * y;
      Eigen::Matrix<double, 2, 5> by;  // k1 k2 p1 p2 k3
      by.row(0) << x * r2, x * r2 * r2, 2 * x * y, r2 + 2 * x * x, x * r2 * r2 * r2;
      by.row(1) << y * r2, y * r2 * r2, r2 + 2 * y * y, 2 * x * y, y * r2 * r2 * r2;
      by.row(0) *= lens[0];
      by.row(1) *= lens[1];
      Eigen::Matrix2d const spread = by * covariance.block<5, 5>(at + 4, at + 4) * by.transpose();
      worst = std::max(worst, std::sqrt(std::max(0.0, spread.trace())));
    }
  return worst;
}

// Gives up one term a round: the first in order that the images neither determine nor need. Wald's test is the
// likelihood ratio's second-order form.
void hold_undetermined(Problem& problem, Estimate& estimate, CalibrateOptions const& options, bool stereo,
                       std::vector<NamedReason>& held) {
  constexpr double kSignificant = 2;
  bool changed = true;
  while (changed) {
    changed = false;
    Covariance const c = covariance(problem, estimate);
    for (Side const side : {Side::left, Side::right}) {
      if (side == Side::right && !stereo) continue;
      cv::Size const size = side == Side::left ? options.left_size : options.right_size;
      double const spread = corner_deviation(c.matrix, estimate, side, size);
      if (!(spread > options.distortion_limit_px)) continue;
      for (int const term : kGivenUp) {
        int const k = (side == Side::left ? 0 : kRight) + term;
        double const deviation = std::sqrt(c.matrix(k, k)), value = estimate.shared[k];
        if (problem.held[static_cast<std::size_t>(k)] || std::abs(value) > kSignificant * deviation) continue;
        held.push_back(
            {shared_name(k),
             fmt::format("the images cannot determine it ({:.2g} +- {:.2g}) and fit as well without; with it "
                         "the distortion at the picture's corner was uncertain by {:.1f} px",
                         value, deviation, spread)});
        problem.held[static_cast<std::size_t>(k)] = true;
        estimate.shared[k] = 0;
        changed = true;
        break;
      }
    }
    if (changed) polish(problem, estimate);
  }
}

void fill_parameters(Problem const& problem, Estimate const& estimate, CalibrateOptions const& options,
                     Covariance const& c, Calibration& result) {
  result.rig.left = estimate.camera(Side::left, options.left_size);
  if (result.stereo) {
    result.rig.right = estimate.camera(Side::right, options.right_size);
    result.rig.right_from_left = estimate.right_from_left();
  }
  result.rig.unit = options.unit;
  // Where corners' own deviations already explain more than the residuals, these say the scale.
  double const scale = std::min(1.0, c.chi2 / c.freedom);
  for (int k = 0; k < kShared; ++k) {
    if (problem.held[static_cast<std::size_t>(k)]) continue;
    double const deviation = std::sqrt(std::max(0.0, c.matrix(k, k)) * scale);
    result.parameters.push_back({shared_name(k), estimate.shared[k], deviation});
    result.rig.standard_deviations[shared_name(k)] = deviation;
  }
}

void fill_boards(std::vector<BoardView> const& views, Problem const& problem, Estimate const& estimate,
                 CalibrateOptions const& options, Calibration& result) {
  result.boards.assign(views.size(), {});
  for (std::size_t i = 0; i < views.size(); ++i) {
    BoardFit& board = result.boards[i];
    board.name = views[i].name;
    board.used = problem.board_used[i];
    board.left_from_board = to_pose(estimate.poses[i]);
    if (board.used) continue;
    board.why = views[i].left.empty() && views[i].right.empty() ? "the board was not found"
                                                                : why_rejected(problem, estimate, i, views, options);
  }
  std::vector<double> sums(views.size(), 0), counts(views.size(), 0);
  double sum = 0;
  for (Observation const& o : problem.observations) {
    BoardFit& board = result.boards[o.board];
    Vector2d const error = residual(estimate, o);
    (o.side == Side::left ? board.left : board.right).push_back({o.id, o.pixel, error, o.corner_ok});
    if (!o.corner_ok && board.used) {
      ++result.corners_rejected;
      continue;
    }
    sums[o.board] += error.squaredNorm();
    counts[o.board] += 1;
    if (!board.used) continue;
    sum += error.squaredNorm();
    ++result.corners;
  }
  for (std::size_t i = 0; i < views.size(); ++i)
    result.boards[i].rms_px = counts[i] > 0 ? std::sqrt(sums[i] / counts[i]) : 0;
  result.rms_px = result.corners ? std::sqrt(sum / static_cast<double>(result.corners)) : 0;
}

void hold_out(std::vector<BoardView> const& views, Problem const& problem, Estimate const& estimate,
              CalibrateOptions const& options, Calibration& result, Context& context) {
  std::vector<double> sums(views.size(), 0), counts(views.size(), 0);
  for_each_index(
      context, views.size(),
      [&](std::size_t i) {
        if (views[i].left.empty() || views[i].right.empty()) return;
        StereoRig rig = result.rig;
        if (problem.board_used[i]) {
          Problem without = problem;
          without.board_used[i] = false;
          Estimate other = estimate;
          solve(without, other, {});
          rig.left = other.camera(Side::left, options.left_size);
          rig.right = other.camera(Side::right, options.right_size);
          rig.right_from_left = other.right_from_left();
        }
        for (BoardCorner const& left : views[i].left)
          for (BoardCorner const& right : views[i].right) {
            if (left.id != right.id) continue;
            double const distance = epipolar_distance(rig, left.pixel, right.pixel);
            if (!std::isfinite(distance)) continue;
            sums[i] += distance * distance;
            counts[i] += 1;
          }
      },
      "hold-out");
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    if (counts[i] > 0) result.boards[i].holdout_px = std::sqrt(sums[i] / counts[i]);
    sum += sums[i];
    count += counts[i];
  }
  if (count > 0) result.holdout_epipolar_rms_px = std::sqrt(sum / count);
}

// Most boards do not agree on a rig: are all pictures of one camera mirrored?
std::string why_inconsistent(std::vector<BoardView> const& views, CalibrateOptions const& options, Start const& start) {
  for (Side const side : {Side::right, Side::left}) {
    std::vector<BoardView> flipped = views;
    for (BoardView& view : flipped) {
      auto& corners = side == Side::left ? view.left : view.right;
      corners =
          mirrored(corners, options.board, side == Side::left ? options.left_size.width : options.right_size.width);
    }
    align_turns(flipped, options.board);
    Start const other = start_values(flipped, options);
    if (2 * other.agreeing > other.common && other.agreeing > start.agreeing)
      return fmt::format(
          "no one rig explains the pictures, but one does when the {} pictures are flipped: they are "
          "mirrored",
          side == Side::left ? "left" : "right");
  }
  return fmt::format(
      "no one rig explains the pictures: at most {} of {} boards agree. Do left and right belong together, "
      "and did the cameras stay fixed to each other?",
      start.agreeing, start.common);
}

bool is_parallel(Covariance const& c, Estimate const& estimate, bool stereo, double limit) {
  for (int const k : {0, 1, kRight, kRight + 1}) {
    if (k >= kRight && !stereo) continue;
    double const relative = std::sqrt(std::max(0.0, c.matrix(k, k))) / std::abs(estimate.shared[k]);
    if (!(relative < limit)) return true;
  }
  return false;
}

// Whether a camera alone cannot tell its focal length: its initial values are then nonsense, and no rig agrees.
bool sees_parallel_boards(std::vector<BoardView> const& views, CalibrateOptions const& options, Side side) {
  std::vector<BoardView> alone = views;
  CalibrateOptions single = options;
  for (BoardView& view : alone) {
    if (side == Side::right) view.left = view.right;
    view.right.clear();
  }
  if (side == Side::right) single.left_size = options.right_size;
  Estimate estimate = start_values(alone, single).estimate;
  Problem problem = make_problem(alone, single);
  for (int k = kRight; k < kShared; ++k) problem.held[static_cast<std::size_t>(k)] = true;
  polish(problem, estimate);
  return is_parallel(covariance(problem, estimate), estimate, false, options.focal_limit);
}

}  // namespace

void CalibrateOptions::validate() const {
  board.validate();
  auto const check = [](bool good, char const* what) {
    if (!good) throw Error(ErrorCode::usage, {}, what);
  };
  check(board_limit > 1, "board_limit must be above 1");
  check(corner_limit >= 3, "corner_limit must be at least 3");
  check(distortion_limit_px > 0, "distortion_limit_px must be positive");
  check(focal_limit > 0 && focal_limit < 1, "focal_limit must be between 0 and 1");
  check(unit == "mm" || unit == "m", "the unit is mm or m");
}

Calibration calibrate(std::vector<BoardView> const& given, CalibrateOptions const& options, Context& context) {
  options.validate();
  check_views(given, options);
  std::vector<BoardView> views = given;
  for (BoardView& view : views)
    for (auto* const corners : {&view.left, &view.right})
      if (corners->size() < kFewestCorners) corners->clear();
  align_turns(views, options.board);
  Problem problem = make_problem(views, options);
  Calibration result;
  Counts const seen = count_boards(views, problem.board_used);
  result.stereo = seen.right > 0 || !options.right_size.empty();
  for (BoardView const& view : views) {
    result.boards.emplace_back();
    result.boards.back().name = view.name;
    result.boards.back().used = false;
  }
  result.reason = too_few(seen, result.stereo);
  if (!result.reason.empty()) return result;
  if (!result.stereo)
    for (int k = kRight; k < kShared; ++k) problem.held[static_cast<std::size_t>(k)] = true;

  Start const start = start_values(views, options);
  Estimate estimate = start.estimate;
  auto const refuse_parallel = [&] {
    result.status = Status::parallel_boards;
    result.reason =
        "the focal length cannot be determined: all boards are nearly parallel to the picture; tilt them by some 30 "
        "degrees, differently in each";
    return result;
  };
  if (result.stereo && 2 * start.agreeing <= start.common) {
    if (sees_parallel_boards(views, options, Side::left) || sees_parallel_boards(views, options, Side::right))
      return refuse_parallel();
    result.status = Status::inconsistent;
    result.reason = why_inconsistent(views, options, start);
    return result;
  }
  context.log(fmt::format("{} boards, {} of them seen by both cameras", seen.used, seen.common));
  reject(problem, estimate, options, context);
  Counts const left_over = count_boards(views, problem.board_used);
  result.reason = too_few(left_over, result.stereo);
  if (2 * left_over.used < seen.used || !result.reason.empty()) {
    fill_boards(views, problem, estimate, options, result);
    result.status = Status::inconsistent;
    result.reason = fmt::format("only {} of {} boards agree with each other", left_over.used, seen.used);
    return result;
  }
  polish(problem, estimate);
  Covariance c = covariance(problem, estimate);
  if (is_parallel(c, estimate, result.stereo, options.focal_limit)) return refuse_parallel();
  hold_undetermined(problem, estimate, options, result.stereo, result.held);
  c = covariance(problem, estimate);
  result.status = Status::solved;
  result.noise_left_px = problem.extra_px[0];
  result.noise_right_px = problem.extra_px[1];
  fill_parameters(problem, estimate, options, c, result);
  fill_boards(views, problem, estimate, options, result);
  if (options.holdout == CalibrateOptions::Holdout::on && result.stereo)
    hold_out(views, problem, estimate, options, result, context);
  return result;
}

double epipolar_distance(StereoRig const& rig, Vector2d const& left, Vector2d const& right) {
  Eigen::Vector3d const p = rig.left.ray(left), q = rig.right.ray(right);
  Eigen::Vector3d const t = rig.right_from_left.translation();
  Eigen::Vector3d const line = t.cross(rig.right_from_left.linear() * p);
  Eigen::Vector3d const line_left = rig.right_from_left.linear().transpose() * q.cross(t);
  double const error = q.dot(line);
  Camera const &a = rig.left.camera, &b = rig.right.camera;
  double const in_right = error / std::hypot(line.x() / b.fx(), line.y() / b.fy());
  double const in_left = error / std::hypot(line_left.x() / a.fx(), line_left.y() / a.fy());
  return std::sqrt((in_left * in_left + in_right * in_right) / 2);
}

}  // namespace scanview
