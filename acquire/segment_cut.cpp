#include "acquire/segment_cut.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/random.h"

namespace scanview {
namespace {

constexpr std::size_t kSamples = 20'000;  // points that vote
constexpr int kTrials = 1'000;  // a plane of 20 % of the points is missed with probability (1 - 0.2^3)^1000 = 3e-4
constexpr double kFewestShare = 0.05;
constexpr double kInlierSigmas = 3, kCutSigmas = 4;

struct Sample {
  Eigen::Vector3d point;
  double sigma;
};

Eigen::Isometry3d pose_or_identity(View const& view) {
  return view.object_from_camera.value_or(Eigen::Isometry3d::Identity());
}

std::vector<Sample> samples_of(std::vector<View const*> const& views) {
  std::size_t total = 0;
  for (auto const* view : views) total += view->image.count_depths();
  std::size_t const stride = std::max<std::size_t>(1, total / kSamples);
  std::vector<Sample> samples;
  std::size_t index = 0;
  for (auto const* view : views)
    for (int y = 0; y < view->image.depth.rows; ++y)
      for (int x = 0; x < view->image.depth.cols; ++x)
        if (view->image.has_depth(x, y) && index++ % stride == 0)
          samples.push_back({pose_or_identity(*view) * view->image.point(x, y), view->image.sigma(y, x)});
  return samples;
}

/// Total least squares on the inliers of a plane; nothing where they are collinear.
std::optional<GroundPlane> refine(GroundPlane const& plane, std::vector<Sample> const& samples) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  std::size_t count = 0;
  auto const holds = [&](Sample const& s) {
    return std::abs(plane.normal.dot(s.point) - plane.offset) <= kInlierSigmas * s.sigma;
  };
  for (auto const& s : samples)
    if (holds(s)) mean += s.point, ++count;
  if (count < 3) return std::nullopt;
  mean /= static_cast<double>(count);
  Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
  for (auto const& s : samples)
    if (holds(s)) moments += (s.point - mean) * (s.point - mean).transpose();
  Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> const eigen(moments);
  if (!(eigen.eigenvalues()(1) > 1e-9 * eigen.eigenvalues()(2))) return std::nullopt;
  GroundPlane better;
  better.normal = eigen.eigenvectors().col(0);
  better.offset = better.normal.dot(mean);
  better.share = static_cast<double>(count) / static_cast<double>(samples.size());
  return better;
}

std::optional<GroundPlane> find_plane(std::vector<View const*> const& views, std::uint64_t seed) {
  auto const samples = samples_of(views);
  if (samples.size() < 3) return std::nullopt;
  auto const count = static_cast<std::uint32_t>(samples.size());
  GroundPlane best;
  std::size_t most = 0;
  for (int trial = 0; trial < kTrials; ++trial) {
    CounterRandom random(seed, 0x67726f756e64, static_cast<std::uint64_t>(trial));
    auto const& a = samples[random.below(count)].point;
    auto const& b = samples[random.below(count)].point;
    auto const& c = samples[random.below(count)].point;
    Eigen::Vector3d const normal = (b - a).cross(c - a);
    if (!(normal.norm() > 1e-6 * (b - a).norm() * (c - a).norm())) continue;
    GroundPlane plane;
    plane.normal = normal.normalized();
    plane.offset = plane.normal.dot(a);
    std::size_t inliers = 0;
    for (auto const& s : samples)
      inliers += std::abs(plane.normal.dot(s.point) - plane.offset) <= kInlierSigmas * s.sigma;
    if (inliers > most) most = inliers, best = plane;
  }
  if (static_cast<double>(most) < kFewestShare * count) return std::nullopt;
  for (int round = 0; round < 3; ++round) {
    auto const better = refine(best, samples);
    if (!better) break;
    best = *better;
  }
  best.share = static_cast<double>(most) / count;
  double eyes = 0;
  for (auto const* view : views) eyes += best.normal.dot(view->eye()) - best.offset;
  if (eyes < 0) best.normal = -best.normal, best.offset = -best.offset;
  return best;
}

std::size_t cut_behind(View& view, GroundPlane const& plane) {
  std::size_t removed = 0;
  Eigen::Isometry3d const pose = pose_or_identity(view);
  for (int y = 0; y < view.image.depth.rows; ++y)
    for (int x = 0; x < view.image.depth.cols; ++x) {
      if (!view.image.has_depth(x, y)) continue;
      double const height = plane.normal.dot(pose * view.image.point(x, y)) - plane.offset;
      // Noise moves a point along its ray, of which the part along the normal counts here; the whole is the safe side.
      if (height > kCutSigmas * view.image.sigma(y, x)) continue;
      view.image.remove(x, y, PixelClass::cut);
      ++removed;
    }
  return removed;
}

}  // namespace

std::size_t cut_box(ScanSet& set, std::array<Eigen::Vector3d, 2> const& box) {
  std::size_t removed = 0;
  for (auto& view : set.views) {
    Eigen::Isometry3d const pose = pose_or_identity(view);
    for (int y = 0; y < view.image.depth.rows; ++y)
      for (int x = 0; x < view.image.depth.cols; ++x) {
        if (!view.image.has_depth(x, y)) continue;
        Eigen::Array3d const p = (pose * view.image.point(x, y)).array();
        if ((p >= box[0].array()).all() && (p <= box[1].array()).all()) continue;
        view.image.remove(x, y, PixelClass::cut);
        ++removed;
      }
  }
  return removed;
}

std::optional<GroundPlane> find_ground(ScanSet const& set, std::uint64_t seed) {
  std::vector<View const*> views;
  for (auto const& view : set.views)
    if (view.object_from_camera) views.push_back(&view);
  if (views.empty() && !set.views.empty()) views.push_back(&set.views.front());
  return find_plane(views, seed);
}

std::size_t cut_ground(ScanSet& set, std::uint64_t seed) {
  std::size_t removed = 0;
  bool const posed =
      std::any_of(set.views.begin(), set.views.end(), [](View const& v) { return v.object_from_camera.has_value(); });
  std::optional<GroundPlane> const common = posed ? find_ground(set, seed) : std::nullopt;
  for (auto& view : set.views) {
    if (posed && !view.object_from_camera) continue;
    auto const plane = posed ? common : find_plane({&view}, seed);
    if (plane) removed += cut_behind(view, *plane);
  }
  return removed;
}

}  // namespace scanview
