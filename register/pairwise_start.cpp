#include "register/pairwise_start.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/parallel.h"
#include "register/feature_match.h"
#include "register/pair_search.h"
#include "register/pairwise_icp.h"
#include "register/shape_features.h"

namespace scanview {
namespace {

constexpr double kMostDeviations = 15;  // of the given poses: farther away nothing is looked for
constexpr std::size_t kMostViews = 60;  // among which pairs are tested against all the others
constexpr double kAgainst = 0.05;       // of the radius: poses against a firm pair
constexpr double kPairAccuracy = 0.01;  // of the radius: what a pairwise motion may be off

MatchOptions cost_options(double radius) {
  MatchOptions options;
  options.radius = radius;
  options.gate = 0.06 * radius;
  options.max_samples = 1500;
  return options;
}

double cost_at(SurfacePyramid const& a, SurfacePyramid const& b, Eigen::Isometry3d const& b_from_a,
               MatchOptions const& options) {
  return match_pair(a.level(1), b.level(1), b_from_a, a.centroid, b.centroid, options).cost;
}

// A few Gauss-Newton steps of one pair alone by projection, shape and tone.
Eigen::Isometry3d polish(SurfacePyramid const& a, SurfacePyramid const& b, Eigen::Isometry3d b_from_a,
                         MatchOptions options) {
  for (int i = 0; i < 6; ++i) {
    PairForm form = match_pair(a.level(1), b.level(1), b_from_a, a.centroid, b.centroid, options);
    if (form.hits_ab + form.hits_ba < 50) break;
    // Scales of this pair, for the next step.
    options.geometry_scale = std::max(0.05, robust_scale(form.geometry.values));
    if (!form.tone.values.empty()) options.tone_scale = std::max(0.01, robust_scale(form.tone.values));
    options.geometry_share = effective_share(form.geometry.correlation());
    options.tone_share = effective_share(form.tone.correlation());
    form.information.diagonal().array() += 1e-6 * form.information.trace() + 1e-12;
    Vector6d const step = -form.information.ldlt().solve(form.gradient);
    if (!step.allFinite() || step.norm() > 0.2 * options.radius) break;
    b_from_a = motion(step, form.center, options.radius) * b_from_a;
  }
  return b_from_a;
}

struct Measured {
  PairMeasurement pair;
  bool is_firm = false;  // the views do not contradict it
  double cost = 1;
};

// How firmly shape and tone hold a pair where it was found, as a mean form, so that strong and weak pairs differ by
// direction, not by the number of their pixels.
Measured measured_at(SurfacePyramid const& a, SurfacePyramid const& b, ViewGraphEdge const& edge, bool is_firm,
                     Eigen::Isometry3d const& b_from_a, double radius) {
  PairMeasurement pair{edge.a, edge.b, b_from_a, Matrix6d::Zero(), Vector6d::Zero(), Eigen::Vector3d::Zero()};
  MatchOptions options = cost_options(radius);
  options.hold_free_motions = false;  // else the way there would be held as well
  PairForm const form = match_pair(a.level(1), b.level(1), b_from_a, a.centroid, b.centroid, options);
  pair.center = form.center;
  double const trace = form.information.trace();
  if (trace > 0 && form.hits_ab + form.hits_ba >= 30)
    pair.information = form.information * (6 / trace) / std::pow(kPairAccuracy * radius, 2);
  return {pair, is_firm, form.cost};
}

// What may lie near a start that the views contradict.
struct ViewFeatures {
  Features color, shape;
};

Measured measure_pair(SurfacePyramid const& a, SurfacePyramid const& b, ViewFeatures const& of_a,
                      ViewFeatures const& of_b, Eigen::Isometry3d const& start, ViewGraphEdge const& edge,
                      double radius, double reach, std::uint64_t seed, std::size_t views) {
  MatchOptions const options = cost_options(radius);
  std::vector<Eigen::Isometry3d> candidates{start};
  IcpOptions icp;
  icp.radius = radius;
  ViewSurface const &coarse_a = a.level(2), &coarse_b = b.level(2);
  candidates.push_back(pairwise_icp(coarse_a, coarse_b, start, icp).b_from_a);
  FeatureMotionOptions feature_options;
  feature_options.threshold = 0.02 * radius;
  feature_options.seed = seed;
  feature_options.item = edge.a * views + edge.b;
  FeatureMotion const by_features = match_features(of_a.color, of_b.color, feature_options);
  if (by_features.found) {
    candidates.push_back(by_features.b_from_a);
    icp.first_distance = 0.1;
    candidates.push_back(pairwise_icp(coarse_a, coarse_b, by_features.b_from_a, icp).b_from_a);
  }
  std::size_t const plain = candidates.size();
  for (std::size_t k = 0; k < plain; ++k) candidates.push_back(polish(a, b, candidates[k], options));
  Eigen::Isometry3d best = start;
  double least = 2;
  for (Eigen::Isometry3d const& candidate : candidates) {
    double const cost = cost_at(a, b, candidate, options);
    if (cost >= least) continue;
    least = cost;
    best = candidate;
  }
  // Far off, each of these may have stopped at a wrong place.
  PairSearchOptions search;
  search.radius = radius;
  PairPose found = search_pair(a, b, {}, {best}, search);
  if (found.verdict != PairPose::Verdict::firm) {
    found = search_pair(a, b, {{&of_a.shape, &of_b.shape}, {&of_a.color, &of_b.color}}, {best}, search);
    // What was told of the poses counts more than what a shape with symmetries looks like.
    bool const within = motion_difference(found.b_from_a, start, a.centroid, radius) < reach;
    if (!within) found.verdict = PairPose::Verdict::refused;
    if (found.verdict == PairPose::Verdict::firm) best = found.b_from_a;
  } else if (cost_at(a, b, found.b_from_a, options) < least) {
    best = found.b_from_a;
  }
  return measured_at(a, b, edge, found.verdict == PairPose::Verdict::firm, best, radius);
}

}  // namespace

double mean_pair_cost(std::vector<SurfacePyramid> const& views, std::vector<ViewGraphEdge> const& edges,
                      std::vector<Eigen::Isometry3d> const& poses, double radius, Context& context) {
  std::vector<double> costs(edges.size());
  MatchOptions const options = cost_options(radius);
  for_each_index(context, edges.size(), [&](std::size_t e) {
    ViewGraphEdge const& edge = edges[e];
    costs[e] = cost_at(views[edge.a], views[edge.b], poses[edge.b].inverse() * poses[edge.a], options);
  });
  double sum = 0;
  for (double cost : costs) sum += cost;
  return costs.empty() ? 1 : sum / static_cast<double>(costs.size());
}

std::vector<Eigen::Isometry3d> start_from_pairs(ScanSet const& set, std::vector<SurfacePyramid> const& views,
                                                std::vector<ViewGraphEdge> const& edges, JointProblem const& start,
                                                Context& context) {
  std::size_t const n = views.size();
  JointProblem problem = start;
  double const reach =
      start.belief_std > 0 ? kMostDeviations * start.belief_std : std::numeric_limits<double>::infinity();
  auto const start_of = [&](ViewGraphEdge const& edge) {
    return Eigen::Isometry3d(start.object_from_camera[edge.b].inverse() * start.object_from_camera[edge.a]);
  };
  std::vector<Measured> measured(edges.size());
  // Most starts need no search.
  for_each_index(context, edges.size(), [&](std::size_t e) {
    SurfacePyramid const &a = views[edges[e].a], &b = views[edges[e].b];
    PairSearchOptions search;
    search.radius = problem.radius;
    PairPose const near = search_pair(a, b, {}, {start_of(edges[e])}, search);
    if (near.verdict == PairPose::Verdict::firm)
      measured[e] = measured_at(a, b, edges[e], true, near.b_from_a, problem.radius);
  });
  std::vector<ViewFeatures> features(n);
  std::vector<bool> is_needed(n, false);
  for (std::size_t e = 0; e < edges.size(); ++e)
    if (!measured[e].is_firm) is_needed[edges[e].a] = is_needed[edges[e].b] = true;
  for_each_index(context, n, [&](std::size_t i) {
    if (!is_needed[i] || views[i].depths == 0) return;
    ShapeFeatureOptions shape;
    shape.radius = problem.radius;
    features[i].shape = find_shape_features(views[i].level(1), shape);
    if (!views[i].levels[0].tone.empty()) features[i].color = find_features(set.views[i].image, views[i].levels[0]);
  });
  for_each_index(
      context, edges.size(),
      [&](std::size_t e) {
        ViewGraphEdge const& edge = edges[e];
        if (!measured[e].is_firm)
          measured[e] = measure_pair(views[edge.a], views[edge.b], features[edge.a], features[edge.b], start_of(edge),
                                     edge, problem.radius, reach, context.seed, n);
      },
      "register: pairs");
  problem.pairs.clear();
  for (Measured const& one : measured) problem.pairs.push_back(one.pair);
  for (std::size_t const k : n <= kMostViews ? find_false_pairs(problem) : std::vector<std::size_t>{}) {
    context.log("the pair of " + set.views[measured[k].pair.a].name + " and " + set.views[measured[k].pair.b].name +
                " is dropped: the others contradict it");
    measured[k].pair.information.setZero();
    measured[k].is_firm = false;
    problem.pairs[k] = measured[k].pair;
  }
  // Firm pairs first: a mean cost prefers surfaces that cover each other to those that coincide.
  struct Price {
    int against = 0;  // firm pairs
    double cost = 1;
    bool operator<(Price const& other) const { return std::pair(against, cost) < std::pair(other.against, other.cost); }
  };
  auto const price_of = [&](std::vector<Eigen::Isometry3d> const& poses) {
    Price price{0, mean_pair_cost(views, edges, poses, problem.radius, context)};
    for (Measured const& one : measured) {
      Eigen::Isometry3d const b_from_a = poses[one.pair.b].inverse() * poses[one.pair.a];
      double const off = motion_difference(b_from_a, one.pair.b_from_a, views[one.pair.a].centroid, problem.radius);
      price.against += one.is_firm && off > kAgainst * problem.radius ? 1 : 0;
    }
    return price;
  };
  auto const balanced = [&] {
    return solve_joint(problem, joint_spectrum(problem), PairLoss::cauchy).object_from_camera;
  };
  std::vector<Eigen::Isometry3d> best = start.object_from_camera;
  Price const before = price_of(best);
  Price least = before;
  auto const take_better = [&](std::vector<Eigen::Isometry3d> const& poses) {
    Price const price = price_of(poses);
    if (price < least) least = price, best = poses;
  };
  take_better(balanced());
  // A balance holds what a pair measures loosely; where the start is far off, the way has to be gone whole.
  std::stable_sort(measured.begin(), measured.end(),
                   [](Measured const& l, Measured const& r) { return l.cost < r.cost; });
  std::vector<PairMeasurement> firm;
  for (Measured const& one : measured)
    if (one.is_firm) firm.push_back(one.pair);
  place_along(firm, problem.object_from_camera);
  take_better(problem.object_from_camera);
  take_better(balanced());
  context.log("pairwise start: mean cost " + std::to_string(before.cost) + " -> " + std::to_string(least.cost));
  return best;
}

}  // namespace scanview
