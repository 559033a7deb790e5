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
// Two poses are told apart where their mean squares differ by this share: neighbouring matches share errors, so that
// the number of matches says little about significance.
constexpr double kVisiblyWorse = 1.02;

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
// random; kept in their order.
std::vector<Correspondence> spread(std::vector<Correspondence> const& matches, Camera const& camera, std::size_t count,
                                   std::uint64_t seed) {
  if (matches.size() <= count) return matches;
  constexpr int kColumns = 48, kRows = 32;
  struct Key {
    std::uint64_t random;
    std::size_t index, cell, round;
  };
  std::vector<Key> keys(matches.size());
  auto const at = [](double value, int size, int cells) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>((value + 0.5) / size * cells), 0, cells - 1));
  };
  for (std::size_t i = 0; i < matches.size(); ++i) {
    Eigen::Vector2d const& p = matches[i].left;
    keys[i] = {CounterRandom(seed, 0x59ead, i).bits(), i,
               at(p.y(), camera.height(), kRows) * kColumns + at(p.x(), camera.width(), kColumns), 0};
  }
  auto const by_random = [](Key const& a, Key const& b) {
    return a.random != b.random ? a.random < b.random : a.index < b.index;
  };
  std::sort(keys.begin(), keys.end(), by_random);
  std::vector<std::size_t> seen(kColumns * kRows, 0);
  for (Key& key : keys) key.round = seen[key.cell]++;
  std::nth_element(
      keys.begin(), keys.begin() + static_cast<std::ptrdiff_t>(count), keys.end(),
      [&](Key const& a, Key const& b) { return a.round != b.round ? a.round < b.round : by_random(a, b); });
  keys.resize(count);
  std::sort(keys.begin(), keys.end(), [](Key const& a, Key const& b) { return a.index < b.index; });
  std::vector<Correspondence> result;
  result.reserve(count);
  for (Key const& key : keys) result.push_back(matches[key.index]);
  return result;
}

// Matches that the rig explains: within a multiple of the robust deviation and in front of both cameras.
struct Inliers {
  std::vector<Correspondence> matches;
  double median_px = 0, rms_px = 0, angle_rad = 0;
  double deviation_sigmas = 1;  // robust deviation of sampson / sigma
};

Inliers select_inliers(std::vector<Correspondence> const& matches, StereoRig const& rig, double threshold_px,
                       Context& context) {
  struct Distance {
    double sampson_px, line_px, angle_rad;
  };
  std::vector<Distance> distances(matches.size());
  for_each_match(context, matches.size(), [&](std::size_t i) {
    EpipolarResidual const residual = epipolar_residual(rig, matches[i].left, matches[i].right);
    RayMeeting const meeting = meet(rays(matches[i], rig), rig.right_from_left);
    bool const front = meeting.left_depth > 0 && meeting.right_depth > 0;
    distances[i] = {front ? std::abs(residual.sampson_px) : std::numeric_limits<double>::infinity(),
                    std::abs(residual.line_px), meeting.angle_rad};
  });
  // The deviation of what is near, then again of what that lets through: wrong matches near a line hardly count.
  std::vector<double> limits(matches.size());
  for (std::size_t i = 0; i < matches.size(); ++i)
    limits[i] = std::max(threshold_px, kInlierSigmas * static_cast<double>(matches[i].sigma_px));
  Inliers result;
  for (int round = 0; round < 3; ++round) {
    std::vector<double> normalised;
    for (std::size_t i = 0; i < matches.size(); ++i)
      if (distances[i].sampson_px <= limits[i])
        normalised.push_back(distances[i].sampson_px / static_cast<double>(matches[i].sigma_px));
    result.deviation_sigmas = 1.4826 * median(std::move(normalised));
    for (std::size_t i = 0; i < matches.size(); ++i)
      limits[i] = std::max(kInlierSigmas * result.deviation_sigmas, 0.1) * static_cast<double>(matches[i].sigma_px);
  }
  std::vector<double> lines, angles;
  double squares = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!(distances[i].sampson_px <= limits[i])) continue;
    result.matches.push_back(matches[i]);
    lines.push_back(distances[i].line_px);
    angles.push_back(distances[i].angle_rad);
    squares += distances[i].line_px * distances[i].line_px;
  }
  result.rms_px = std::sqrt(squares / std::max(1.0, static_cast<double>(lines.size())));
  result.median_px = median(std::move(lines));
  result.angle_rad = median(std::move(angles));
  return result;
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

// The candidates adjusted, the best first; each at its own optimum, and in front of the cameras.
struct Adjusted {
  EpipolarFit fit;
  double cost;
};
std::vector<Adjusted> adjust(std::vector<Correspondence> const& matches, StereoRig const& nominal,
                             std::vector<Eigen::Isometry3d> const& poses, EpipolarFitOptions const& options) {
  std::vector<Adjusted> result;
  for (Eigen::Isometry3d const& pose : poses) {
    EpipolarFit fit = fit_epipolar(matches, with_pose(nominal, pose), options);
    if (!fit.usable) continue;
    double const front = share_in_front(rays(matches, fit.rig), fit.rig.right_from_left);
    if (front < 0.5) continue;
    double const cost = fit.cost;
    result.push_back({std::move(fit), cost});
  }
  std::stable_sort(result.begin(), result.end(), [](Adjusted const& a, Adjusted const& b) { return a.cost < b.cost; });
  return result;
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
                              RelativePoseOptions const& options, double cauchy_sigmas,
                              std::vector<std::string>& held) {
  EpipolarFitOptions fitting{options.refine_focal, options.refine_distortion, cauchy_sigmas};
  held.clear();
  for (;;) {
    if (!fitting.focal && !fitting.k1) return fit_epipolar(matches, start.rig, fitting);
    EpipolarFit fit = fit_epipolar(matches, start.rig, fitting);
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

std::vector<Correspondence> usable_matches(std::vector<Correspondence> const& matches, StereoRig const& rig,
                                           Context& context) {
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (!matches[i].left.allFinite() || !matches[i].right.allFinite() || !std::isfinite(matches[i].sigma_px) ||
        !(matches[i].sigma_px > 0))
      throw Error(ErrorCode::bad_input, {}, fmt::format("match {} is not finite, or its deviation is not positive", i));
  std::vector<char> good(matches.size(), 0);
  for_each_match(context, matches.size(), [&](std::size_t i) {
    RayPair const pair = rays(matches[i], rig);
    good[i] = pair.left.allFinite() && pair.right.allFinite() ? 1 : 0;
  });
  std::vector<Correspondence> result;
  for (std::size_t i = 0; i < matches.size(); ++i)
    if (good[i] != 0) result.push_back(matches[i]);
  return result;
}

RelativePoseResult ended(RelativePoseResult result, RelativePoseResult::Status status, std::string reason) {
  result.status = status;
  result.reason = std::move(reason);
  return result;
}

void take(RelativePoseResult& result, EpipolarFit const& fit, Inliers const& inliers, LensCamera const& given) {
  result.rig = fit.rig;
  result.inliers = inliers.matches.size();
  result.epipolar_median_px = inliers.median_px;
  result.epipolar_rms_px = inliers.rms_px;
  result.angle_deg = kDegrees * inliers.angle_rad;
  result.focal_factor = fit.rig.left.camera.fx() / given.camera.fx();
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

RelativePoseResult solve_relative_pose(std::vector<Correspondence> const& given, LensCamera const& left,
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
  auto const matches = usable_matches(given, nominal, context);
  result.matches = matches.size();
  if (matches.size() < options.min_matches)
    return ended(std::move(result), Status::too_few,
                 fmt::format("{} matches between left and right are too few for a pose (at least {}): is the same "
                             "surface lit in both pictures?",
                             matches.size(), options.min_matches));

  EssentialSearchOptions search;
  search.threshold = options.threshold_px * 2 / (focal(left) + focal(right));
  auto const candidates =
      search_essential(rays(spread(matches, left.camera, kSearchMatches, context.seed), nominal), search, context);
  std::string const no_consensus =
      "the matches do not agree on one pose of the cameras: do both pictures show the same pattern, and are the "
      "intrinsics those of these cameras?";
  if (candidates.empty()) return ended(std::move(result), Status::no_consensus, no_consensus);
  std::vector<Eigen::Isometry3d> poses;
  for (PoseCandidate const& candidate : candidates) poses.push_back(candidate.right_from_left);

  // Adjusted from every candidate and from the twin that a plane would have, on fewer matches; then the best on all.
  auto const compared = spread(matches, left.camera, kCompareMatches, context.seed + 1);
  std::vector<double> sigmas;
  for (Correspondence const& match : compared) sigmas.push_back(static_cast<double>(match.sigma_px));
  // Unless the deviations promise better, as coarse as the search: the intrinsics may still be wrong.
  EpipolarFitOptions const coarse{false, false, std::max(2.0, 0.5 * options.threshold_px / median(sigmas))};
  auto const first = adjust(compared, nominal, poses, coarse);
  if (first.empty()) return ended(std::move(result), Status::no_consensus, no_consensus);
  Inliers inliers = select_inliers(matches, first.front().fit.rig, options.threshold_px, context);
  if (static_cast<double>(inliers.matches.size()) <
      std::max(options.min_inlier_share * static_cast<double>(matches.size()),
               static_cast<double>(options.min_matches)))
    return ended(std::move(result), Status::no_consensus,
                 fmt::format("only {} of {} matches agree with the best pose: {}", inliers.matches.size(),
                             matches.size(), no_consensus));

  EpipolarFit best = first.front().fit;
  for (bool const robust : {true, false}) {
    double const cauchy_sigmas = robust ? 2 * std::max(1.0, inliers.deviation_sigmas) : 0;
    auto const chosen = spread(robust ? matches : inliers.matches, left.camera, options.most_matches, context.seed + 2);
    EpipolarFit const fit = adjust_intrinsics(chosen, best, options, cauchy_sigmas, result.held);
    if (fit.usable) best = fit;
    inliers = select_inliers(matches, best.rig, options.threshold_px, context);
    context.check_cancelled();
  }
  take(result, best, inliers, left);

  auto const judged = spread(inliers.matches, left.camera, kCompareMatches, context.seed + 3);
  auto const judged_rays = rays(judged, best.rig);
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

  std::vector<Eigen::Isometry3d> rivals = plane_twins(judged_rays, best.rig.right_from_left);
  for (Adjusted const& other : first) rivals.push_back(other.fit.rig.right_from_left);
  EpipolarFitOptions const contest_options{false, false, 3 * std::max(1.0, inliers.deviation_sigmas)};
  auto const contest = adjust(judged, best.rig, rivals, contest_options);
  double const best_cost = fit_epipolar(judged, best.rig, contest_options).cost;
  for (Adjusted const& other : contest) {
    if (other.cost > kVisiblyWorse * best_cost) break;
    double const turn = 0.25 / kDegrees, direction = 1 / kDegrees;
    Eigen::Isometry3d const& pose = other.fit.rig.right_from_left;
    if (nearly_equal(pose, best.rig.right_from_left, turn, direction)) continue;
    if (share_in_front(judged_rays, pose) < 0.9) continue;
    result.alternative = pose;
    double const apart =
        std::abs(Eigen::AngleAxisd(pose.linear().transpose() * best.rig.right_from_left.linear()).angle());
    return ended(std::move(result), Status::planar_ambiguous,
                 fmt::format("two poses of the cameras, {:.1f}° apart, explain the matches equally well: the scene is "
                             "nearly one plane; put something with depth into it",
                             kDegrees * apart));
  }
  result.status = Status::solved;
  return result;
}

}  // namespace scanview
