#include "calib/relative_pose.h"

#include <fmt/format.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>

#include "base/error.h"
#include "base/median.h"
#include "base/parallel.h"
#include "base/random.h"
#include "calib/essential_search.h"

namespace scanview {
namespace {

constexpr double kDegrees = 180 / std::numbers::pi;
constexpr std::size_t kSearchMatches = 2000, kCompareMatches = 4000;
constexpr double kInlierSigmas = 3.5;

// Two poses are told apart where their mean squares differ by more than chance would have it. Each pose sees another
// component of a match's noise, so that both means scatter, by sqrt(2 / matches) each; three deviations of their
// difference. At least 2 %: neighbouring matches share errors.
double visibly_worse(std::size_t matches) { return 1 + std::max(0.02, 6 / std::sqrt(static_cast<double>(matches))); }

double focal(LensCamera const& camera) { return std::sqrt(camera.camera.fx() * camera.camera.fy()); }

RayPair rays(Correspondence const& match, StereoRig const& rig) {
  return {rig.left.ray(match.left).head<2>(), rig.right.ray(match.right).head<2>()};
}

std::vector<RayPair> rays(std::vector<Correspondence> const& matches, StereoRig const& rig) {
  std::vector<RayPair> result;
  result.reserve(matches.size());
  for (Correspondence const& match : matches) result.push_back(rays(match, rig));
  return result;
}

// Calls work(i) for every index, in parallel.
template <typename Work>
void for_each_match(Context& context, std::size_t count, Work const& work) {
  constexpr std::size_t kGrain = 4096;
  for_each_index(context, (count + kGrain - 1) / kGrain, [&](std::size_t chunk) {
    for (std::size_t i = chunk * kGrain; i < std::min(count, (chunk + 1) * kGrain); ++i) work(i);
  });
}

// At most `count` matches spread over the left picture: round by round one of every cell that still has some, drawn at
// random. In that order, so that the first of them are spread too.
std::vector<Correspondence> spread(std::vector<Correspondence> const& matches, Camera const& camera, std::size_t count,
                                   std::uint64_t seed) {
  constexpr int kColumns = 48, kRows = 32;
  struct Cell {
    std::size_t first = 0, last = 0;  // of its matches not drawn yet
  };
  std::vector<Cell> cells(kColumns * kRows);
  double const columns_per_px = static_cast<double>(kColumns) / camera.width();
  double const rows_per_px = static_cast<double>(kRows) / camera.height();
  auto const cell_of = [&](Eigen::Vector2d const& p) -> Cell& {
    int const column = std::clamp(static_cast<int>((p.x() + 0.5) * columns_per_px), 0, kColumns - 1);
    int const row = std::clamp(static_cast<int>((p.y() + 0.5) * rows_per_px), 0, kRows - 1);
    return cells[static_cast<std::size_t>(row * kColumns + column)];
  };
  for (Correspondence const& match : matches) ++cell_of(match.left).last;
  std::size_t before = 0;
  for (Cell& cell : cells) {
    std::size_t const size = cell.last;
    cell.first = cell.last = before;
    before += size;
  }
  std::vector<std::size_t> by_cell(matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i) by_cell[cell_of(matches[i].left).last++] = i;

  CounterRandom random(seed, 0x59ead);
  auto const below = [&](std::size_t bound) { return random.below(static_cast<std::uint32_t>(bound)); };
  // The cells in random order: the last round does not reach all.
  for (std::size_t i = 1; i < cells.size(); ++i) std::swap(cells[i], cells[below(i + 1)]);
  std::vector<Correspondence> result;
  result.reserve(std::min(count, matches.size()));
  while (result.size() < std::min(count, matches.size())) {
    std::erase_if(cells, [](Cell const& cell) { return cell.first == cell.last; });
    for (Cell& cell : cells) {
      if (result.size() == count) break;
      std::swap(by_cell[cell.first], by_cell[cell.first + below(cell.last - cell.first)]);
      result.push_back(matches[by_cell[cell.first++]]);
    }
  }
  return result;
}

// The first `count` of them.
std::vector<Correspondence> first_of(std::vector<Correspondence> const& matches, std::size_t count) {
  return {matches.begin(), matches.begin() + static_cast<std::ptrdiff_t>(std::min(count, matches.size()))};
}

// Matches that the rig explains: within a multiple of the robust deviation and in front of both cameras.
struct Inliers {
  std::vector<Correspondence> matches;
  double median_px = 0, rms_px = 0;
  double deviation_sigmas = 1;  // robust deviation of sampson / sigma
};

Inliers select_inliers(std::vector<Correspondence> const& matches, StereoRig const& rig, double threshold_px,
                       Context& context) {
  struct Distance {
    double sampson_sigmas, line_px;
  };
  std::vector<Distance> distances(matches.size());
  for_each_match(context, matches.size(), [&](std::size_t i) {
    EpipolarResidual const residual = epipolar_residual(rig, matches[i].left, matches[i].right);
    bool const front = in_front(residual.rays, rig.right_from_left);
    distances[i] = {front ? std::abs(residual.sampson_px) / static_cast<double>(matches[i].sigma_px)
                          : std::numeric_limits<double>::infinity(),
                    std::abs(residual.line_px)};
  });
  // The deviation of what is near, then again of what that lets through: wrong matches near a line hardly count.
  Inliers result;
  std::vector<double> near;
  near.reserve(matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (distances[i].sampson_sigmas <= std::max(threshold_px / static_cast<double>(matches[i].sigma_px), kInlierSigmas))
      near.push_back(distances[i].sampson_sigmas);
  double most_sigmas = 0;
  for (int round = 0; round < 3; ++round) {
    result.deviation_sigmas = 1.4826 * median(near);
    most_sigmas = std::max(kInlierSigmas * result.deviation_sigmas, 0.1);
    near.clear();
    for (Distance const& distance : distances)
      if (distance.sampson_sigmas <= most_sigmas) near.push_back(distance.sampson_sigmas);
  }
  result.matches.reserve(near.size());
  std::vector<double> lines;
  lines.reserve(near.size());
  double squares = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!(distances[i].sampson_sigmas <= most_sigmas)) continue;
    result.matches.push_back(matches[i]);
    lines.push_back(distances[i].line_px);
    squares += distances[i].line_px * distances[i].line_px;
  }
  result.rms_px = std::sqrt(squares / std::max(1.0, static_cast<double>(lines.size())));
  result.median_px = median(std::move(lines));
  return result;
}

// The median angle between the two rays of a match.
double median_angle(std::vector<RayPair> const& matches, Eigen::Isometry3d const& pose) {
  std::vector<double> angles;
  for (RayPair const& match : matches) angles.push_back(meet(match, pose).angle_rad);
  return median(std::move(angles));
}

// The plane n·X = 1 (left camera, baselines) nearest to the points, robustly: inverse depth is linear in the ray.
Eigen::Vector3d fit_plane(std::vector<RayPair> const& matches, Eigen::Isometry3d const& pose) {
  std::vector<double> inverse_depths;
  std::vector<Eigen::Vector3d> directions;
  for (RayPair const& match : matches) {
    RayMeeting const meeting = meet(match, pose);
    if (!(meeting.left_depth > 0) || !std::isfinite(meeting.left_depth)) continue;
    inverse_depths.push_back(1 / meeting.left_depth);
    directions.push_back(match.left.homogeneous());
  }
  Eigen::Vector3d plane(0, 0, median(inverse_depths));
  for (int round = 0; round < 15; ++round) {
    std::vector<double> errors;
    for (std::size_t i = 0; i < directions.size(); ++i)
      errors.push_back(std::abs(plane.dot(directions[i]) - inverse_depths[i]));
    double const scale = std::max(2 * 1.4826 * median(errors), 1e-12);
    Eigen::Matrix3d information = Eigen::Matrix3d::Identity() * 1e-9;
    Eigen::Vector3d right_side = 1e-9 * plane;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      double const weight = 1 / (1 + std::pow(errors[i] / scale, 2));
      information += weight * directions[i] * directions[i].transpose();
      right_side += weight * inverse_depths[i] * directions[i];
    }
    plane = information.ldlt().solve(right_side);
  }
  return plane;
}

// The other pose that maps the plane nearest to the points in the same way (Faugeras and Lustman 1988).
std::vector<Eigen::Isometry3d> plane_twins(std::vector<RayPair> const& matches, Eigen::Isometry3d const& pose) {
  Eigen::Vector3d const plane = fit_plane(matches, pose);
  if (!plane.allFinite() || plane.norm() < 1e-9) return {};
  Eigen::Matrix3d const homography = pose.linear() + pose.translation() * plane.transpose();
  cv::Matx33d matrix;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) matrix(r, c) = homography(r, c);
  std::vector<cv::Mat> turns, directions, normals;
  try {
    cv::decomposeHomographyMat(matrix, cv::Matx33d::eye(), turns, directions, normals);
  } catch (cv::Exception const&) {
    return {};
  }
  std::vector<Eigen::Isometry3d> twins;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    Eigen::Isometry3d twin = Eigen::Isometry3d::Identity();
    for (int r = 0; r < 3; ++r) {
      twin.translation()[r] = directions[i].at<double>(r);
      for (int c = 0; c < 3; ++c) twin.linear()(r, c) = turns[i].at<double>(r, c);
    }
    if (!twin.matrix().allFinite() || twin.translation().norm() < 1e-9) continue;
    twin.translation().normalize();
    twins.push_back(twin);
  }
  return twins;
}

// How far the matches are from a rotation alone (Kabsch on the directions), the median in radians.
double rotation_residual(std::vector<RayPair> const& matches) {
  std::vector<double> errors(matches.size(), 0);
  double scale = 1;
  for (int round = 0; round < 10; ++round) {
    Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
    for (std::size_t i = 0; i < matches.size(); ++i)
      sum += matches[i].right.homogeneous().normalized() * matches[i].left.homogeneous().normalized().transpose() /
             (1 + std::pow(errors[i] / scale, 2));
    Eigen::JacobiSVD<Eigen::Matrix3d> const svd(sum, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Vector3d flip(1, 1, (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0 ? -1 : 1);
    Eigen::Matrix3d const turn = svd.matrixU() * flip.asDiagonal() * svd.matrixV().transpose();
    for (std::size_t i = 0; i < matches.size(); ++i)
      errors[i] =
          (turn * matches[i].left.homogeneous().normalized() - matches[i].right.homogeneous().normalized()).norm();
    scale = std::max(2 * median(errors), 1e-12);
  }
  return median(errors);
}

StereoRig with_pose(StereoRig rig, Eigen::Isometry3d const& pose) {
  rig.right_from_left = pose;
  return rig;
}

// Whether two poses are of one optimum.
bool is_same(Eigen::Isometry3d const& a, Eigen::Isometry3d const& b) {
  return nearly_equal(a, b, 0.25 / kDegrees, 1 / kDegrees);
}

// Without those that cannot be used.
std::vector<EpipolarFit> best_first(std::vector<EpipolarFit> fits) {
  std::erase_if(fits, [](EpipolarFit const& fit) { return !fit.usable; });
  std::stable_sort(fits.begin(), fits.end(),
                   [](EpipolarFit const& a, EpipolarFit const& b) { return a.cost < b.cost; });
  return fits;
}

std::vector<EpipolarFit> adjust_each(std::vector<Correspondence> const& matches, StereoRig const& nominal,
                                     std::vector<Eigen::Isometry3d> const& poses, EpipolarFitOptions const& options,
                                     Context& context) {
  std::vector<EpipolarFit> fits(poses.size());
  for_each_index(context, poses.size(), [&](std::size_t i) {
    fits[i] = fit_epipolar(matches, with_pose(nominal, poses[i]), options, context);
  });
  return best_first(std::move(fits));
}

// The optima in front of the cameras that the poses lead to, the best first. A few matches tell which are hopeless, and
// which the same.
std::vector<EpipolarFit> adjust(std::vector<Correspondence> const& matches, StereoRig const& nominal,
                                std::vector<Eigen::Isometry3d> const& poses, double cauchy_sigmas, Context& context) {
  constexpr std::size_t kFew = 500;
  constexpr double kHopeless = 2;  // times the best cost
  EpipolarFitOptions options;
  options.cauchy_sigmas = cauchy_sigmas;
  options.least_gain = 1e-7;
  auto const tried = adjust_each(first_of(matches, kFew), nominal, poses, options, context);
  std::vector<Eigen::Isometry3d> hopeful;
  for (EpipolarFit const& fit : tried) {
    Eigen::Isometry3d const& pose = fit.rig.right_from_left;
    if (fit.cost > kHopeless * tried.front().cost) break;
    if (std::none_of(hopeful.begin(), hopeful.end(), [&](auto const& other) { return is_same(pose, other); }))
      hopeful.push_back(pose);
  }
  auto fits = adjust_each(matches, nominal, hopeful, options, context);
  // A match behind a camera is not explained: of two poses of a plane, one may have half of it there, and still fit as
  // well or, by chance, better.
  for (EpipolarFit& fit : fits) {
    double const front = share_in_front(rays(matches, fit.rig), fit.rig.right_from_left);
    fit.usable = front >= 0.5;
    fit.cost /= front;
  }
  return best_first(std::move(fits));
}

double outermost(std::vector<Correspondence> const& matches, StereoRig const& rig) {
  std::vector<double> radii;
  for (Correspondence const& match : matches) radii.push_back(rig.left.ray(match.left).head<2>().norm());
  auto const at = radii.begin() + static_cast<std::ptrdiff_t>(radii.size() * 95 / 100);
  std::nth_element(radii.begin(), at, radii.end());
  return *at;
}

// The adjustment with what was asked for; what comes out too uncertain is held, and named.
EpipolarFit adjust_intrinsics(std::vector<Correspondence> const& matches, EpipolarFit const& start,
                              RelativePoseOptions const& options, double cauchy_sigmas, std::vector<std::string>& held,
                              Context& context) {
  EpipolarFitOptions fitting;
  fitting.focal = options.refine_focal;
  fitting.k1 = options.refine_distortion;
  fitting.cauchy_sigmas = cauchy_sigmas;
  held.clear();
  for (;;) {
    if (!fitting.focal && !fitting.k1) return fit_epipolar(matches, start.rig, fitting, context);
    EpipolarFit fit = fit_epipolar(matches, start.rig, fitting, context);
    double const radius = outermost(matches, start.rig);
    double const bend_px = fit.k1_std * std::pow(radius, 3) * focal(start.rig.left);
    if (fitting.focal && (!fit.usable || fit.focal_std > options.max_focal_std)) {
      held.push_back(fit.usable ? fmt::format("focal length: the matches determine it only to ±{:.1f} %, so the given "
                                              "one stays (cameras that point at one spot from equal distances, or a "
                                              "flat scene, leave it open)",
                                              100 * fit.focal_std)
                                : std::string("focal length: the matches do not determine it, so the given one stays"));
      fitting.focal = false;
    } else if (fitting.k1 && (!fit.usable || bend_px > options.max_distortion_px)) {
      held.push_back(
          fit.usable
              ? fmt::format("k1: the matches leave ±{:.1f} px at their outermost, so the given one stays", bend_px)
              : std::string("k1: the matches do not determine it, so the given one stays"));
      fitting.k1 = false;
    } else {
      return fit;
    }
  }
}

// Takes out those that a lens has no ray for.
void keep_usable(std::vector<Correspondence>& matches, StereoRig const& rig, Context& context) {
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (!matches[i].left.allFinite() || !matches[i].right.allFinite() || !std::isfinite(matches[i].sigma_px) ||
        !(matches[i].sigma_px > 0))
      throw Error(ErrorCode::bad_input, {}, fmt::format("match {} is not finite, or its deviation is not positive", i));
  if (rig.left.lens.is_ideal() && rig.right.lens.is_ideal()) return;
  for_each_match(context, matches.size(), [&](std::size_t i) {
    RayPair const pair = rays(matches[i], rig);
    if (!pair.left.allFinite() || !pair.right.allFinite()) matches[i].sigma_px = 0;
  });
  std::erase_if(matches, [](Correspondence const& match) { return match.sigma_px == 0; });
}

RelativePoseResult ended(RelativePoseResult result, RelativePoseResult::Status status, std::string reason) {
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

}  // namespace

void RelativePoseOptions::validate() const {
  auto const require = [](bool good, char const* what) {
    if (!good) throw Error(ErrorCode::usage, {}, fmt::format("relative pose: {}", what));
  };
  require(threshold_px > 0 && std::isfinite(threshold_px), "threshold_px must be positive");
  require(min_matches >= 10, "min_matches must be at least 10");
  require(min_inlier_share > 0 && min_inlier_share <= 1, "min_inlier_share must be in (0, 1]");
  require(min_angle_deg >= 0 && min_angle_deg < 90, "min_angle_deg must be in [0, 90)");
  require(max_focal_std > 0, "max_focal_std must be positive");
  require(max_distortion_px > 0, "max_distortion_px must be positive");
  require(most_matches >= min_matches, "most_matches must be at least min_matches");
}

std::string to_string(RelativePoseResult::Status status) {
  switch (status) {
    case RelativePoseResult::Status::solved:
      return "solved";
    case RelativePoseResult::Status::too_few:
      return "too few matches";
    case RelativePoseResult::Status::no_consensus:
      return "no consensus";
    case RelativePoseResult::Status::degenerate_baseline:
      return "degenerate baseline";
    case RelativePoseResult::Status::planar_ambiguous:
      return "planar and ambiguous";
  }
  return {};
}

Json RelativePoseResult::to_json() const {
  Json deviations = Json::object();
  for (auto const& [name, value] : rig.standard_deviations) deviations[name] = json_number(value);
  Json json = {{"status", to_string(status)},
               {"reason", reason},
               {"matches", matches},
               {"inliers", inliers},
               {"epipolar_median_px", json_number(epipolar_median_px)},
               {"epipolar_rms_px", json_number(epipolar_rms_px)},
               {"angle_deg", json_number(angle_deg)},
               {"focal_factor", json_number(focal_factor)},
               {"held", held},
               {"right_from_left", pose_to_json(rig.right_from_left)},
               {"standard_deviations", deviations}};
  if (alternative) json["alternative"] = pose_to_json(*alternative);
  return json;
}

RelativePoseResult solve_relative_pose(std::vector<Correspondence> matches, LensCamera const& left,
                                       LensCamera const& right, RelativePoseOptions const& options, Context& context) {
  using Status = RelativePoseResult::Status;
  options.validate();
  if (!left.camera.is_perspective() || !right.camera.is_perspective())
    throw Error(ErrorCode::usage, {}, "relative pose: both cameras must be perspective");
  StereoRig nominal;
  nominal.left = left;
  nominal.right = right;
  nominal.unit = "arbitrary";
  nominal.right_from_left.translation() = Eigen::Vector3d::UnitX();
  RelativePoseResult result;
  result.rig = nominal;
  keep_usable(matches, nominal, context);
  result.matches = matches.size();
  if (matches.size() < options.min_matches)
    return ended(std::move(result), Status::too_few,
                 fmt::format("{} matches between left and right are too few for a pose (at least {}): is the same "
                             "surface lit in both pictures?",
                             matches.size(), options.min_matches));

  // The first of the chosen serve the search and the comparison of poses, all of them the pose, and all matches only
  // its figures.
  auto const chosen = spread(matches, left.camera, options.most_matches, context.seed);
  EssentialSearchOptions search;
  search.threshold = options.threshold_px * 2 / (focal(left) + focal(right));
  auto const candidates = search_essential(rays(first_of(chosen, kSearchMatches), nominal), search, context);
  std::string const no_consensus =
      "the matches do not agree on one pose of the cameras: do both pictures show the same pattern, and are the "
      "intrinsics those of these cameras?";
  if (candidates.empty()) return ended(std::move(result), Status::no_consensus, no_consensus);
  std::vector<Eigen::Isometry3d> poses;
  for (PoseCandidate const& candidate : candidates) poses.push_back(candidate.right_from_left);

  auto const compared = first_of(chosen, kCompareMatches);
  std::vector<double> sigmas;
  for (Correspondence const& match : compared) sigmas.push_back(static_cast<double>(match.sigma_px));
  // Unless the deviations promise better, as coarse as the search: the intrinsics may still be wrong.
  double const coarse_sigmas = std::max(2.0, 0.5 * options.threshold_px / median(std::move(sigmas)));
  auto const first = adjust(compared, nominal, poses, coarse_sigmas, context);
  if (first.empty()) return ended(std::move(result), Status::no_consensus, no_consensus);
  EpipolarFit best = first.front();
  Inliers inliers = select_inliers(compared, best.rig, options.threshold_px, context);
  if (static_cast<double>(inliers.matches.size()) <
      std::max(options.min_inlier_share * static_cast<double>(compared.size()),
               static_cast<double>(options.min_matches)))
    return ended(std::move(result), Status::no_consensus,
                 fmt::format("only {} of {} matches agree with the best pose: {}", inliers.matches.size(),
                             compared.size(), no_consensus));

  auto const improve = [&](std::vector<Correspondence> const& by, double cauchy_sigmas) {
    EpipolarFit fit = adjust_intrinsics(by, best, options, cauchy_sigmas, result.held, context);
    if (fit.usable) best = std::move(fit);
    context.check_cancelled();
  };
  improve(compared, 2 * std::max(1.0, inliers.deviation_sigmas));
  inliers = select_inliers(chosen, best.rig, options.threshold_px, context);
  improve(inliers.matches, 0);
  auto const judged = first_of(inliers.matches, kCompareMatches);
  auto const judged_rays = rays(judged, best.rig);
  inliers = select_inliers(matches, best.rig, options.threshold_px, context);
  result.rig = best.rig;
  result.inliers = inliers.matches.size();
  result.epipolar_median_px = inliers.median_px;
  result.epipolar_rms_px = inliers.rms_px;
  result.angle_deg = kDegrees * median_angle(judged_rays, best.rig.right_from_left);
  result.focal_factor = best.rig.left.camera.fx() / left.camera.fx();

  double const deviation_px = std::max(inliers.median_px, 0.05);
  double const turned_px = rotation_residual(judged_rays) * focal(left);
  if (turned_px < 3 * deviation_px)
    return ended(std::move(result), Status::degenerate_baseline,
                 fmt::format("the pictures differ by a rotation alone (all but {:.2f} px): there is no parallax to "
                             "measure depth with; move the camera sideways",
                             turned_px));
  if (result.angle_deg < options.min_angle_deg)
    return ended(std::move(result), Status::degenerate_baseline,
                 fmt::format("the two rays to a point meet under {:.2f}° (median), less than {:.2f}°: depths would be "
                             "noise; move the cameras farther apart",
                             result.angle_deg, options.min_angle_deg));

  Eigen::Isometry3d const& chosen_pose = best.rig.right_from_left;
  std::vector<Eigen::Isometry3d> rivals = plane_twins(judged_rays, chosen_pose);
  for (EpipolarFit const& other : first) rivals.push_back(other.rig.right_from_left);
  rivals.push_back(chosen_pose);
  auto const contest = adjust(judged, best.rig, rivals, 3 * std::max(1.0, inliers.deviation_sigmas), context);
  auto const itself = std::find_if(contest.begin(), contest.end(), [&](EpipolarFit const& fit) {
    return is_same(fit.rig.right_from_left, chosen_pose);
  });
  double const cost = itself != contest.end() ? itself->cost : std::numeric_limits<double>::infinity();
  for (EpipolarFit const& other : contest) {
    if (other.cost > visibly_worse(judged.size()) * cost) break;
    Eigen::Isometry3d const& pose = other.rig.right_from_left;
    if (is_same(pose, chosen_pose) || share_in_front(judged_rays, pose) < 0.9) continue;
    result.alternative = pose;
    double const apart = std::abs(Eigen::AngleAxisd(pose.linear().transpose() * chosen_pose.linear()).angle());
    return ended(std::move(result), Status::planar_ambiguous,
                 fmt::format("two poses of the cameras, {:.1f}° apart, explain the matches equally well: the scene is "
                             "nearly one plane; put something with depth into it",
                             kDegrees * apart));
  }
  result.status = Status::solved;
  return result;
}

}  // namespace scanview
