#include "calib/essential_search.h"

#include <Eigen/LU>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <optional>

#include "base/parallel.h"
#include "base/random.h"

namespace scanview {
namespace {

constexpr std::size_t kSample = 5;
constexpr int kBatch = 16, kFewestSamples = 48;
constexpr std::size_t kKept = 24;  // essential matrices that are decomposed at the end

struct ScoredEssential {
  Eigen::Matrix3d matrix;
  double score = 0;
};

double sampson_square(Eigen::Matrix3d const& essential, RayPair const& match) {
  Eigen::Vector3d const line = essential * match.left.homogeneous();
  Eigen::Vector3d const line_left = essential.transpose() * match.right.homogeneous();
  double const error = match.right.homogeneous().dot(line);
  double const slope = line.head<2>().squaredNorm() + line_left.head<2>().squaredNorm();
  return slope > 0 ? error * error / slope : 0;
}

// Where it would be above `bound`, nothing.
std::optional<double> score_of(Eigen::Matrix3d const& essential, std::vector<RayPair> const& matches, double threshold,
                               double bound) {
  constexpr std::size_t kBetweenLooks = 64;
  auto const count = static_cast<double>(matches.size());
  double const scale = 1 / (threshold * threshold);
  double sum = 0;
  for (std::size_t first = 0; first < matches.size(); first += kBetweenLooks) {
    std::size_t const last = std::min(matches.size(), first + kBetweenLooks);
    for (std::size_t i = first; i < last; ++i) sum += std::min(1.0, scale * sampson_square(essential, matches[i]));
    if (sum > bound * count) return std::nullopt;
  }
  return sum / count;
}

std::vector<Eigen::Matrix3d> solve_five(std::vector<RayPair> const& matches,
                                        std::array<std::size_t, kSample> const& sample) {
  cv::Mat2d left(kSample, 1), right(kSample, 1);
  for (std::size_t i = 0; i < kSample; ++i) {
    RayPair const& match = matches[sample[i]];
    left(static_cast<int>(i)) = {match.left.x(), match.left.y()};
    right(static_cast<int>(i)) = {match.right.x(), match.right.y()};
  }
  cv::Mat stacked;
  try {
    // Exactly five points: OpenCV runs its solver once, without its random generator.
    stacked = cv::findEssentialMat(left, right, cv::Matx33d::eye(), cv::RANSAC, 0.999, 1.0);
  } catch (cv::Exception const&) {
    return {};  // a degenerate sample (two equal points)
  }
  std::vector<Eigen::Matrix3d> solutions;
  for (int top = 0; top + 3 <= stacked.rows; top += 3) {
    Eigen::Matrix3d matrix;
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) matrix(r, c) = stacked.at<double>(top + r, c);
    if (matrix.allFinite() && matrix.norm() > 0) solutions.push_back(matrix / matrix.norm());
  }
  return solutions;
}

// Of the four poses of an essential matrix, the one that puts most inliers in front of both cameras.
PoseCandidate decompose(ScoredEssential const& essential, std::vector<RayPair> const& matches, double threshold) {
  constexpr std::size_t kEnough = 200;
  std::vector<RayPair> inliers;
  for (RayPair const& match : matches) {
    if (inliers.size() == kEnough) break;
    if (sampson_square(essential.matrix, match) < threshold * threshold) inliers.push_back(match);
  }
  Eigen::JacobiSVD<Eigen::Matrix3d> const svd(essential.matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
  if (u.determinant() < 0) u.col(2) *= -1;
  if (v.determinant() < 0) v.col(2) *= -1;
  Eigen::Matrix3d quarter;
  quarter << 0, -1, 0, 1, 0, 0, 0, 0, 1;
  PoseCandidate best;
  double most = -1;
  for (Eigen::Matrix3d const& turn : {Eigen::Matrix3d(quarter), Eigen::Matrix3d(quarter.transpose())})
    for (double const sign : {1.0, -1.0}) {
      Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
      pose.linear() = u * turn * v.transpose();
      pose.translation() = sign * u.col(2);
      double const share = inliers.empty() ? 0 : share_in_front(inliers, pose);
      if (share > most) {
        most = share;
        best.right_from_left = pose;
      }
    }
  best.score = essential.score;
  return best;
}

std::array<std::size_t, kSample> draw(std::size_t count, std::uint64_t seed, std::uint64_t number) {
  CounterRandom random(seed, 0x9e1a, number);
  std::array<std::size_t, kSample> sample{};
  for (auto next = sample.begin(); next != sample.end(); ++next) {
    do *next = random.below(static_cast<std::uint32_t>(count));
    while (std::find(sample.begin(), next, *next) != next);
  }
  return sample;
}

int samples_needed(double inlier_share, EssentialSearchOptions const& options) {
  double const good = std::pow(inlier_share, static_cast<double>(kSample));
  if (good <= 0) return options.most_samples;
  if (good >= 1) return 1;
  double const count = std::log(options.failure_chance) / std::log1p(-good);
  return count < options.most_samples ? static_cast<int>(count) + 1 : options.most_samples;
}

}  // namespace

RayMeeting meet(RayPair const& match, Eigen::Isometry3d const& right_from_left) {
  Eigen::Vector3d const a = right_from_left.linear() * match.left.homogeneous(), b = match.right.homogeneous();
  Eigen::Vector3d const& t = right_from_left.translation();
  // t + depth_a a ≈ depth_b b
  double const aa = a.squaredNorm(), bb = b.squaredNorm(), ab = a.dot(b);
  double const determinant = a.cross(b).squaredNorm();  // aa bb - ab², without its cancellation
  RayMeeting result;
  result.angle_rad = std::atan2(std::sqrt(determinant), ab);
  if (!(determinant > 0)) {
    result.left_depth = result.right_depth = std::numeric_limits<double>::infinity();
    return result;
  }
  result.left_depth = (ab * b.dot(t) - bb * a.dot(t)) / determinant;
  result.right_depth = (aa * b.dot(t) - ab * a.dot(t)) / determinant;
  return result;
}

bool in_front(RayPair const& match, Eigen::Isometry3d const& right_from_left) {
  // The signs of the depths that meet() finds.
  Eigen::Vector3d const a = right_from_left.linear() * match.left.homogeneous(), b = match.right.homogeneous();
  Eigen::Vector3d const& t = right_from_left.translation();
  if (!(a.cross(b).squaredNorm() > 0)) return true;
  double const ab = a.dot(b), at = a.dot(t), bt = b.dot(t);
  return ab * bt > b.squaredNorm() * at && a.squaredNorm() * bt > ab * at;
}

double share_in_front(std::vector<RayPair> const& matches, Eigen::Isometry3d const& right_from_left) {
  auto const front = std::count_if(matches.begin(), matches.end(),
                                   [&](RayPair const& match) { return in_front(match, right_from_left); });
  return static_cast<double>(front) / static_cast<double>(matches.size());
}

bool nearly_equal(Eigen::Isometry3d const& a, Eigen::Isometry3d const& b, double turn_rad, double direction_rad) {
  double const turn = Eigen::AngleAxisd(a.linear().transpose() * b.linear()).angle();
  double const cosine = a.translation().normalized().dot(b.translation().normalized());
  return std::abs(turn) < turn_rad && std::acos(std::clamp(cosine, -1.0, 1.0)) < direction_rad;
}

std::vector<PoseCandidate> search_essential(std::vector<RayPair> const& matches, EssentialSearchOptions const& options,
                                            Context& context) {
  if (matches.size() <= kSample) return {};
  std::vector<ScoredEssential> kept;
  auto const better = [](ScoredEssential const& a, ScoredEssential const& b) { return a.score < b.score; };
  // Samples of a batch are looked at in parallel, against what was kept before it.
  int needed = options.most_samples;
  for (int done = 0; done < needed; done += kBatch) {
    double const bound = kept.size() == kKept ? kept.back().score : 1;
    std::array<std::vector<ScoredEssential>, kBatch> found;
    for_each_index(context, kBatch, [&](std::size_t k) {
      auto const sample = draw(matches.size(), context.seed, static_cast<std::uint64_t>(done) + k);
      for (Eigen::Matrix3d const& matrix : solve_five(matches, sample))
        if (auto const score = score_of(matrix, matches, options.threshold, bound))
          found[k].push_back({matrix, *score});
    });
    for (auto const& scored : found) kept.insert(kept.end(), scored.begin(), scored.end());
    std::stable_sort(kept.begin(), kept.end(), better);
    kept.resize(std::min(kept.size(), kKept));
    if (!kept.empty()) needed = std::max(kFewestSamples, samples_needed(1 - kept.front().score, options));
  }
  constexpr double kDegree = std::numbers::pi / 180;
  std::vector<PoseCandidate> candidates;
  for (ScoredEssential const& essential : kept) {
    PoseCandidate const candidate = decompose(essential, matches, options.threshold);
    bool const known = std::any_of(candidates.begin(), candidates.end(), [&](PoseCandidate const& other) {
      return nearly_equal(candidate.right_from_left, other.right_from_left, 0.5 * kDegree, 2 * kDegree);
    });
    if (!known) candidates.push_back(candidate);
    if (candidates.size() == options.most_candidates) break;
  }
  return candidates;
}

}  // namespace scanview
