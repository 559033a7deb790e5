#include "calib/calibrate_reject.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

constexpr double kCauchySigmas = 2.4;
constexpr double kMedianOfSquare = 1.3862943611198906;  // of the sum of two squared normals: 2 ln 2
constexpr double kMostOutliers = 0.2;                   // share of a board's corners; more: the board is at fault

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double squared_distance(Estimate const& estimate, Observation const& o) {
  double const square = residual(estimate, o).squaredNorm();
  return std::isfinite(square) ? square : 1e12;
}

using Indices = std::vector<std::size_t>;

// Observations by board and side.
std::vector<std::array<Indices, 2>> by_view(Problem const& problem) {
  std::vector<std::array<Indices, 2>> result(problem.board_used.size());
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    Observation const& o = problem.observations[i];
    result[o.board][static_cast<std::size_t>(o.side)].push_back(i);
  }
  return result;
}

// The corners' outliers are judged against the view's own noise where it is larger: a bent board is a bent board.
ViewFigures judge(Problem const& problem, Estimate const& estimate, Indices const& view, double corner_limit) {
  ViewFigures figures;
  figures.corners = view.size();
  if (view.empty()) return figures;
  std::vector<double> squares;
  for (std::size_t const i : view) {
    Observation const& o = problem.observations[i];
    double const deviation = problem.deviation(o);
    squares.push_back(squared_distance(estimate, o) / (deviation * deviation));
  }
  figures.robust = std::sqrt(median(squares) / kMedianOfSquare);
  double const limit = corner_limit * std::max(1.0, figures.robust);
  double sum = 0, sum_px = 0;
  for (std::size_t k = 0; k < view.size(); ++k) {
    if (squares[k] > limit * limit) {
      ++figures.outliers;
      continue;
    }
    sum += squares[k];
    sum_px += squared_distance(estimate, problem.observations[view[k]]);
  }
  double const good = std::max(1.0, static_cast<double>(view.size() - figures.outliers));
  figures.rms = std::sqrt(sum / (2 * good));
  figures.rms_px = std::sqrt(sum_px / good);
  return figures;
}

// Few corners scatter more: two deviations of an RMS of n pairs.
double allowance(std::size_t corners) {
  return 1 + 1 / std::sqrt(static_cast<double>(std::max<std::size_t>(1, corners)));
}

bool fails(ViewFigures const& figures, double limit) {
  if (figures.corners == 0) return false;
  return figures.rms > limit * allowance(figures.corners) ||
         static_cast<double>(figures.outliers) > std::max(1.0, kMostOutliers * static_cast<double>(figures.corners));
}

// The limit is in units of what boards usually have, at least the noise itself.
double board_limit(std::vector<double> const& of_boards, CalibrateOptions const& options) {
  return options.board_limit * std::max(1.0, median(of_boards));
}

struct Verdict {
  std::vector<bool> boards;
  std::vector<bool> corners;
  bool operator==(Verdict const&) const = default;
};

Verdict current(Problem const& problem) {
  Verdict verdict{problem.board_used, {}};
  for (Observation const& o : problem.observations) verdict.corners.push_back(o.corner_ok);
  return verdict;
}

std::array<double, 2> limits(Problem const& problem, Estimate const& estimate, CalibrateOptions const& options,
                             std::vector<std::array<Indices, 2>> const& views) {
  std::array<double, 2> result = {options.board_limit, options.board_limit};
  for (std::size_t side = 0; side < 2; ++side) {
    std::vector<double> rms;
    for (std::size_t b = 0; b < views.size(); ++b)
      if (problem.board_used[b] && !views[b][side].empty())
        rms.push_back(judge(problem, estimate, views[b][side], options.corner_limit).rms);
    result[side] = board_limit(rms, options);
  }
  return result;
}

Indices both(std::array<Indices, 2> const& view) {
  Indices all = view[0];
  all.insert(all.end(), view[1].begin(), view[1].end());
  return all;
}

// The estimate with the pose of a board as one picture alone says it.
Estimate from_one_picture(Estimate const& estimate, std::size_t board, Side side, BoardView const& view,
                          CalibrateOptions const& options) {
  Estimate result = estimate;
  bool const left = side == Side::left;
  auto const pose = pose_before(estimate.camera(side, left ? options.left_size : options.right_size),
                                left ? view.left : view.right, options.board);
  if (pose) result.poses[board] = to_vector(left ? *pose : estimate.right_from_left().inverse() * *pose);
  return result;
}

}  // namespace

void estimate_noise(Problem& problem, Estimate const& estimate, NoiseFrom from) {
  std::array<double, 2> count = {0, 0};
  double total = 0, unknowns = 0;
  std::vector<bool> seen(problem.board_used.size(), false);
  for (Observation const& o : problem.observations)
    if (problem.uses(o)) {
      count[static_cast<std::size_t>(o.side)] += 2;
      total += 2;
      seen[o.board] = true;
    }
  unknowns = 6.0 * static_cast<double>(std::count(seen.begin(), seen.end(), true)) +
             static_cast<double>(std::count(problem.held.begin(), problem.held.end(), false));
  // Each camera bears its share of the unknowns.
  double const share = std::max(0.05, 1 - unknowns / std::max(1.0, total));
  for (std::size_t side = 0; side < 2; ++side) {
    std::vector<std::pair<double, double>> pairs;  // squared distance, the corner's variance
    for (Observation const& o : problem.observations)
      if (problem.uses(o) && static_cast<std::size_t>(o.side) == side)
        pairs.emplace_back(squared_distance(estimate, o), o.sigma_px * o.sigma_px);
    if (pairs.empty()) continue;
    auto const excess = [&](double variance) {
      std::vector<double> ratios;
      double sum = 0;
      for (auto const& [square, own] : pairs) {
        double const ratio = square / std::max(1e-12, own + variance);
        ratios.push_back(ratio);
        sum += ratio;
      }
      return from == NoiseFrom::median ? median(std::move(ratios)) / (kMedianOfSquare * share) - 1
                                       : sum / (count[side] * share) - 1;
    };
    double low = 0, high = 1e-6;
    while (excess(high) > 0 && high < 1e8) high *= 4;
    if (excess(0) <= 0) high = 0;
    for (int step = 0; step < 60 && high > 0; ++step) {
      double const middle = (low + high) / 2;
      (excess(middle) > 0 ? low : high) = middle;
    }
    problem.extra_px[side] = std::sqrt(high);
  }
}

void reject(Problem& problem, Estimate& estimate, CalibrateOptions const& options, Context& context) {
  constexpr int kRounds = 8;
  auto const views = by_view(problem);
  std::vector<PoseVector> const first = estimate.poses;
  for (int round = 0; round < kRounds; ++round) {
    context.check_cancelled();
    // The first noise is that of initial values, which are one camera's each: robust, and refined while solving.
    for (int step = 0; step < 3; ++step) {
      estimate_noise(problem, estimate, NoiseFrom::median);
      solve(problem, estimate, {.cauchy_sigmas = kCauchySigmas});
    }
    estimate_noise(problem, estimate, NoiseFrom::median);
    for (std::size_t b = 0; b < views.size(); ++b)
      if (!problem.board_used[b] && !(views[b][0].empty() && views[b][1].empty())) {
        estimate.poses[b] = first[b];
        estimate.poses[b] = solve_pose(problem, estimate, b, both(views[b]));
      }
    Verdict const before = current(problem);
    auto const limit = limits(problem, estimate, options, views);
    for (std::size_t b = 0; b < views.size(); ++b) {
      bool bad = views[b][0].empty() && views[b][1].empty();
      for (std::size_t side = 0; side < 2; ++side) {
        ViewFigures const figures = judge(problem, estimate, views[b][side], options.corner_limit);
        bad = bad || fails(figures, limit[side]);
        double const corner_limit = options.corner_limit * std::max(1.0, figures.robust);
        for (std::size_t const i : views[b][side]) {
          Observation& o = problem.observations[i];
          o.corner_ok = std::sqrt(squared_distance(estimate, o)) <= corner_limit * problem.deviation(o);
        }
      }
      problem.board_used[b] = !bad;
    }
    if (current(problem) == before) return;
  }
}

std::string why_rejected(Problem const& problem, Estimate const& estimate, std::size_t board,
                         std::vector<BoardView> const& views, CalibrateOptions const& options) {
  auto const indices = by_view(problem);
  auto const& view = indices[board];
  auto const limit = limits(problem, estimate, options, indices);
  constexpr std::array kSides = {"left", "right"};
  std::array<ViewFigures, 2> together, alone;
  std::array<bool, 2> bad = {false, false};
  Estimate fitted = estimate;
  fitted.poses[board] = solve_pose(problem, fitted, board, both(view));
  for (std::size_t side = 0; side < 2; ++side) {
    together[side] = judge(problem, fitted, view[side], 1e6);
    if (view[side].empty()) continue;
    Estimate single = from_one_picture(estimate, board, side == 0 ? Side::left : Side::right, views[board], options);
    single.poses[board] = solve_pose(problem, single, board, view[side]);
    alone[side] = judge(problem, single, view[side], 1e6);
    bad[side] = fails(judge(problem, single, view[side], options.corner_limit), limit[side]);
  }
  std::size_t const corners = together[0].corners + together[1].corners;
  double const rms = std::sqrt((together[0].rms_px * together[0].rms_px * static_cast<double>(together[0].corners) +
                                together[1].rms_px * together[1].rms_px * static_cast<double>(together[1].corners)) /
                               std::max(1.0, static_cast<double>(corners)));
  bool const stereo = !view[0].empty() && !view[1].empty();
  std::string const start = fmt::format("its {} corners disagree with the other boards by {:.1f} px (usual: {:.2f} px)",
                                        stereo ? std::max(together[0].corners, together[1].corners) : corners, rms,
                                        std::numbers::sqrt2 * std::max(problem.extra_px[0], problem.extra_px[1]));
  if (bad[0] && bad[1]) return fmt::format("{}: in both pictures they lie on no flat board of this kind: bent", start);
  for (std::size_t side = 0; side < 2; ++side)
    if (bad[side])
      return fmt::format("{}: in the {} picture they lie on no flat board ({:.1f} px): bent, or moved during that shot",
                         start, kSides[side], alone[side].rms_px);
  if (!stereo) return start;
  for (std::size_t side = 0; side < 2; ++side) {
    std::vector<BoardView> one = {views[board]};
    auto& corners_of_side = side == 0 ? one[0].left : one[0].right;
    corners_of_side =
        mirrored(corners_of_side, options.board, side == 0 ? options.left_size.width : options.right_size.width);
    align_turns(one, options.board);
    Problem flipped = problem;
    std::size_t next = 0;
    for (std::size_t const i : view[side]) {
      Observation& o = flipped.observations[i];
      o.pixel = corners_of_side[next].pixel;
      o.id = corners_of_side[next].id;
      o.on_board = options.board.corner(o.id);
      ++next;
    }
    Estimate trial = from_one_picture(estimate, board, side == 0 ? Side::right : Side::left, views[board], options);
    trial.poses[board] = solve_pose(flipped, trial, board, both(view));
    if (!fails(judge(flipped, trial, view[0], options.corner_limit), limit[0]) &&
        !fails(judge(flipped, trial, view[1], options.corner_limit), limit[1]))
      return fmt::format("{}: its {} picture is mirrored", start, kSides[side]);
  }
  return fmt::format("{}, though each picture alone fits ({:.2f} and {:.2f} px): moved between the two shots", start,
                     alone[0].rms_px, alone[1].rms_px);
}

}  // namespace scanview
