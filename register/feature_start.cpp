#include "register/feature_start.h"

#include <fmt/format.h>

#include <algorithm>
#include <numeric>

#include "base/parallel.h"
#include "register/feature_match.h"
#include "register/joint_refinement.h"
#include "register/view_graph.h"

namespace scanview {
namespace {

constexpr double kSamePoint = 0.03;      // of the radius: matched points that coincide
constexpr std::size_t kMinInliers = 12;  // far above what chance makes of a few hundred matches
constexpr double kMinShare = 0.15;       // of the matches: print that recurs elsewhere fits by few of them
constexpr double kMaxInFront = 0.15;     // of a view's samples: would hide what the other view saw
constexpr double kAgreement = 0.15;      // of the radius: a further link against the links that placed the views
constexpr double kLinkAccuracy = 0.01;   // of the radius: what a link may be off

struct Link {
  std::size_t a = 0, b = 0;
  FeatureMotion motion;
};

// Share of a's samples that would stand before the surface which b saw there: empty space, by b's word.
double share_in_front(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a, double margin) {
  SampleGrid const grid(a, 1000);
  double asked = 0, in_front = 0;
  for (SurfaceSample const& sample : a.samples) {
    if (!grid.contains(sample)) continue;
    ++asked;
    SurfaceHit hit;
    Eigen::Vector3d const p = b_from_a * sample.point;
    if (look_up(b, p, hit) && p.z() < hit.point.z() - margin) ++in_front;
  }
  return asked > 0 ? in_front / asked : 0;
}

bool is_possible(Link const& link, std::vector<SurfacePyramid> const& views, double radius) {
  if (!link.motion.found ||
      static_cast<double>(link.motion.inliers) < kMinShare * static_cast<double>(link.motion.matches))
    return false;
  ViewSurface const &a = views[link.a].levels[0], &b = views[link.b].levels[0];
  double const margin = 2 * kSamePoint * radius;
  return share_in_front(a, b, link.motion.b_from_a, margin) < kMaxInFront &&
         share_in_front(b, a, link.motion.b_from_a.inverse(), margin) < kMaxInFront;
}

// How firmly its points hold a link, as a mean form.
PairMeasurement measurement_of(Link const& link, double radius) {
  PairMeasurement pair;
  pair.a = link.a;
  pair.b = link.b;
  pair.b_from_a = link.motion.b_from_a;
  for (Eigen::Vector3d const& p : link.motion.points) pair.center += p;
  auto const count = static_cast<double>(link.motion.points.size());
  pair.center /= count;
  for (Eigen::Vector3d const& p : link.motion.points)
    for (int axis = 0; axis < 3; ++axis) {
      Vector6d row;
      row << (p - pair.center).cross(Eigen::Vector3d::Unit(axis)) / radius, Eigen::Vector3d::Unit(axis);
      pair.information += row * row.transpose();
    }
  pair.information *= 1 / (count * kLinkAccuracy * kLinkAccuracy * radius * radius);
  return pair;
}

// How far a link and poses disagree about where a's centroid and two points a radius beside it fall in b.
double disagreement(Link const& link, std::vector<Eigen::Isometry3d> const& poses,
                    std::vector<SurfacePyramid> const& views, double radius) {
  Eigen::Isometry3d const b_from_a = poses[link.b].inverse() * poses[link.a];
  double largest = 0;
  for (Eigen::Vector3d const& offset :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(radius, 0, 0), Eigen::Vector3d(0, radius, 0)}) {
    Eigen::Vector3d const p = views[link.a].centroid + offset;
    largest = std::max(largest, (b_from_a * p - link.motion.b_from_a * p).norm());
  }
  return largest;
}

}  // namespace

bool FeatureStart::joins(std::vector<SurfacePyramid> const& views) const {
  std::size_t const with_depths = static_cast<std::size_t>(
      std::count_if(views.begin(), views.end(), [](SurfacePyramid const& view) { return view.depths > 0; }));
  return !parts.empty() && parts.front().size() >= with_depths && with_depths > 1;
}

FeatureStart start_from_features(ScanSet const& set, std::vector<SurfacePyramid> const& views, double radius,
                                 Context& context) {
  std::size_t const n = views.size();
  std::vector<Features> features(n);
  for_each_index(
      context, n,
      [&](std::size_t i) {
        if (views[i].depths > 0 && !views[i].levels[0].tone.empty())
          features[i] = find_features(set.views[i].image, views[i].levels[0]);
      },
      "register: features");
  std::vector<Link> all;
  for (std::size_t a = 0; a < n; ++a)
    for (std::size_t b = a + 1; b < n; ++b) all.push_back({a, b, {}});
  for_each_index(
      context, all.size(),
      [&](std::size_t k) {
        Link& link = all[k];
        FeatureMotionOptions options;
        options.threshold = kSamePoint * radius;
        options.min_inliers = kMinInliers;
        options.seed = context.seed;
        options.item = link.a * n + link.b;
        link.motion = match_features(features[link.a], features[link.b], options);
        link.motion.found = is_possible(link, views, radius);
      },
      "register: feature pairs");
  std::vector<Link> links;
  for (Link& link : all)
    if (link.motion.found) links.push_back(std::move(link));
  std::stable_sort(links.begin(), links.end(),
                   [](Link const& l, Link const& r) { return l.motion.inliers > r.motion.inliers; });

  // Kruskal: parts grow together along the strongest links; a part's views move as one.
  FeatureStart start;
  start.object_from_camera.assign(n, Eigen::Isometry3d::Identity());
  std::vector<std::size_t> part(n);
  std::iota(part.begin(), part.end(), std::size_t{0});
  std::vector<ViewGraphEdge> tree;
  auto& poses = start.object_from_camera;
  for (Link const& link : links) {
    std::size_t const keep = std::min(part[link.a], part[link.b]), go = std::max(part[link.a], part[link.b]);
    if (keep == go) continue;
    Eigen::Isometry3d const a_from_b = link.motion.b_from_a.inverse();
    Eigen::Isometry3d const move = part[link.a] == keep
                                       ? poses[link.a] * a_from_b * poses[link.b].inverse()
                                       : poses[link.b] * link.motion.b_from_a * poses[link.a].inverse();
    for (std::size_t i = 0; i < n; ++i)
      if (part[i] == go) {
        poses[i] = move * poses[i];
        part[i] = keep;
      }
    tree.push_back({link.a, link.b, 0, 0});
  }
  start.parts = connected_parts(n, tree);

  JointProblem problem;
  problem.radius = radius;
  problem.object_from_camera = poses;
  problem.fixed.assign(n, false);
  for (auto const& views_of_part : start.parts) problem.fixed[views_of_part.front()] = true;
  for (SurfacePyramid const& view : views) problem.centroids.push_back(view.centroid);
  for (Link const& link : links)
    if (disagreement(link, poses, views, radius) < kAgreement * radius)
      problem.pairs.push_back(measurement_of(link, radius));
  start.object_from_camera = solve_joint(problem, joint_spectrum(problem), PairLoss::cauchy).object_from_camera;
  context.log(fmt::format("features: {} pairs of views fit by colour, {} agree, {} parts", links.size(),
                          problem.pairs.size(), start.parts.size()));
  return start;
}

}  // namespace scanview
