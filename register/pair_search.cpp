#include "register/pair_search.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

namespace scanview {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kShortest = 0.15, kSameLength = 0.025;  // radii: between two features, and by what that may differ
constexpr double kSameAngle = 12 * kDegree;
constexpr std::size_t kMostMatches = 1500, kMostPoses = 6000;
constexpr double kCoarseGate = 0.05;  // radii
constexpr std::size_t kFewSamples = 120, kSomeSamples = 500, kManySamples = 1500;
constexpr std::size_t kLookedAt = 150, kRefined = 12, kFinal = 4;
constexpr double kSameTurn = 8 * kDegree, kSamePlace = 0.08;  // radii: two poses that are one
constexpr double kDamping = 1e-4;                             // of the trace: free motions stay
constexpr std::size_t kFewestMatched = 30;
constexpr std::size_t kFewestTones = 50;
constexpr double kLeastPrint = 0.03;    // of brightness: robust standard deviation
constexpr double kLeastLikeness = 0.5;  // of print that meets itself

struct Candidate {
  Eigen::Isometry3d b_from_a;
  double score;
};

void check_one_way(ViewSurface const& from, ViewSurface const& to, Eigen::Isometry3d const& to_from_from, double gate,
                   std::size_t max_samples, PoseCheck& check, std::size_t& asked) {
  constexpr double kAlike = 0.6;
  SampleGrid const grid(from, max_samples);
  for (SurfaceSample const& sample : from.samples) {
    if (!grid.contains(sample)) continue;
    ++asked;
    Eigen::Vector3d const p = to_from_from * sample.point;
    SurfaceHit hit;
    if (!look_up(to, p, hit)) continue;
    double const along = hit.normal.dot(p - hit.point);
    // On a slanted surface the depth differs by more than the distance.
    if (std::abs(along) <= gate && std::abs(p.z() - hit.point.z()) <= 3 * gate) {
      bool const alike = (to_from_from.linear() * sample.normal).dot(hit.normal) > kAlike;
      (alike ? check.matched : check.crossed) += 1;
      if (alike) check.quality += 1 - std::pow(along / gate, 2);
    } else if (p.z() < hit.point.z()) {
      ++check.in_front;
    }
  }
}

/// The pose that carries two oriented points onto two others; none where the normals say nothing about the turn around
/// the line between them.
std::optional<Eigen::Isometry3d> pose_of_pair(Eigen::Vector3d const& pa, Eigen::Vector3d const& qa,
                                              Eigen::Vector3d const& normals_a, Eigen::Vector3d const& pb,
                                              Eigen::Vector3d const& qb, Eigen::Vector3d const& normals_b) {
  auto const frame = [](Eigen::Vector3d const& line, Eigen::Vector3d const& up, Eigen::Matrix3d& axes) {
    Eigen::Vector3d const x = line.normalized(), across = up - up.dot(x) * x;
    if (across.norm() < 0.3) return false;
    Eigen::Vector3d const y = across.normalized();
    axes << x, y, x.cross(y);
    return true;
  };
  Eigen::Matrix3d of_a, of_b;
  if (!frame(qa - pa, normals_a, of_a) || !frame(qb - pb, normals_b, of_b)) return {};
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  pose.linear() = of_b * of_a.transpose();
  pose.translation() = 0.5 * (pb + qb) - pose.linear() * (0.5 * (pa + qa));
  return pose;
}

void add_poses(Features const& a, Features const& b, PairSearchOptions const& options,
               std::vector<Candidate>& candidates) {
  std::vector<FeatureMatch> matches = nearest_matches(a, b, options.nearest);
  if (matches.size() > kMostMatches) {
    std::stable_sort(matches.begin(), matches.end(),
                     [](FeatureMatch const& l, FeatureMatch const& r) { return l.likeness > r.likeness; });
    matches.resize(kMostMatches);
  }
  double const shortest = kShortest * options.radius, same = kSameLength * options.radius;
  double const same_angle = std::sin(kSameAngle);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    Eigen::Vector3d const &pa = a.points[matches[i].a], &pb = b.points[matches[i].b];
    Eigen::Vector3d const &na = a.normals[matches[i].a], &nb = b.normals[matches[i].b];
    for (std::size_t k = i + 1; k < matches.size(); ++k) {
      Eigen::Vector3d const &qa = a.points[matches[k].a], &qb = b.points[matches[k].b];
      Eigen::Vector3d const da = qa - pa, db = qb - pb;
      double const la = da.norm(), lb = db.norm();
      if (la < shortest || std::abs(la - lb) > same) continue;
      Eigen::Vector3d const &ma = a.normals[matches[k].a], &mb = b.normals[matches[k].b];
      if (std::abs(na.dot(ma) - nb.dot(mb)) > same_angle) continue;
      if (std::abs(na.dot(da) / la - nb.dot(db) / lb) > same_angle) continue;
      if (std::abs(ma.dot(da) / la - mb.dot(db) / lb) > same_angle) continue;
      if (auto const pose = pose_of_pair(pa, qa, na + ma, pb, qb, nb + mb))
        candidates.push_back({*pose, static_cast<double>(matches[i].likeness + matches[k].likeness)});
    }
  }
}

void keep_best(std::vector<Candidate>& candidates, std::size_t count) {
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](Candidate const& l, Candidate const& r) { return l.score > r.score; });
  if (candidates.size() > count) candidates.resize(count);
}

bool is_same(Eigen::Isometry3d const& l, Eigen::Isometry3d const& r, Eigen::Vector3d const& centroid, double radius) {
  double const turn = Eigen::AngleAxisd(l.linear().transpose() * r.linear()).angle();
  return std::abs(turn) < kSameTurn && (l * centroid - r * centroid).norm() < kSamePlace * radius;
}

void keep_distinct(std::vector<Candidate>& candidates, std::size_t count, Eigen::Vector3d const& centroid,
                   double radius) {
  keep_best(candidates, candidates.size());
  std::vector<Candidate> kept;
  for (Candidate const& candidate : candidates) {
    if (kept.size() == count) break;
    bool const known = std::any_of(kept.begin(), kept.end(), [&](Candidate const& other) {
      return is_same(candidate.b_from_a, other.b_from_a, centroid, radius);
    });
    if (!known) kept.push_back(candidate);
  }
  candidates = std::move(kept);
}

/// Correlation of the tones where the surfaces meet; 0 where too few do.
double print_likeness(SurfacePyramid const& a, SurfacePyramid const& b, Eigen::Isometry3d const& b_from_a, double gate,
                      double radius) {
  MatchOptions options;
  options.radius = radius;
  options.gate = gate;
  options.max_samples = kManySamples;
  PairForm const form = match_pair(a.level(1), b.level(1), b_from_a, a.centroid, b.centroid, options);
  return form.tone.values.size() >= kFewestTones ? form.tone_correlation : 0;
}

/// What a score is multiplied with: of two poses that fit alike, the one that lays print on print counts.
double agreement(double likeness, double score) { return score > 0 ? std::max(likeness, 0.05) : 1; }

struct Misfit {
  double in_sigmas = 0, distance = 0;
};

/// Gauss-Newton by projection, shape alone, with a gate that narrows.
Misfit refine(ViewSurface const& a, ViewSurface const& b, SurfacePyramid const& of_a, SurfacePyramid const& of_b,
              double first_gate, double last_gate, int iterations, std::size_t samples, double radius,
              Eigen::Isometry3d& b_from_a) {
  MatchOptions options;
  options.radius = radius;
  options.max_samples = samples;
  options.use = MatchOptions::Use::shape;
  options.hold_free_motions = false;
  Misfit misfit;
  for (int i = 0; i < iterations; ++i) {
    double const share = iterations > 1 ? static_cast<double>(i) / (iterations - 1) : 1;
    options.gate = first_gate * std::pow(last_gate / first_gate, share);
    PairForm form = match_pair(a, b, b_from_a, of_a.centroid, of_b.centroid, options);
    if (form.hits_ab + form.hits_ba < 20) break;
    misfit = {robust_scale(form.geometry.values), robust_scale(form.distances)};
    options.geometry_scale = std::max(0.05, misfit.in_sigmas);
    form.information.diagonal().array() += kDamping * form.information.trace() + 1e-300;
    Vector6d step = -form.information.ldlt().solve(form.gradient);
    if (!step.allFinite()) break;
    if (step.norm() > 0.2 * radius) step *= 0.2 * radius / step.norm();
    b_from_a = motion(step, form.center, radius) * b_from_a;
    if (share >= 1 && step.norm() < 1e-4 * radius) break;
  }
  return misfit;
}

/// Right poses of laser scans and synthetic views have contradictions below 0.014 and misfits below 2, wrong ones above
/// 0.1 or 3; right poses of sensors whose depths bend have contradictions of 0.04 to 0.15.
PairPose::Verdict judge(PairPose const& pose, bool has_print) {
  if (pose.check.matched < kFewestMatched) return PairPose::Verdict::refused;
  double const contradiction = pose.check.contradiction();
  bool const prints_agree = pose.likeness > kLeastLikeness;
  if (prints_agree && contradiction < 0.02 && pose.misfit < 2.5) return PairPose::Verdict::firm;
  if (has_print && prints_agree && contradiction < 0.1 && pose.misfit < 4) return PairPose::Verdict::firm;
  return pose.likeness > 0.3 && contradiction < 0.2 && pose.misfit < 4 ? PairPose::Verdict::weak
                                                                       : PairPose::Verdict::refused;
}

}  // namespace

bool has_print(SurfacePyramid const& view) {
  std::vector<float> tones;
  for (SurfaceSample const& sample : view.level(1).samples)
    if (std::isfinite(sample.tone)) tones.push_back(sample.tone);
  return tones.size() >= kFewestTones && robust_scale(tones) > kLeastPrint;
}

double pose_score(SurfacePyramid const& a, SurfacePyramid const& b, Eigen::Isometry3d const& b_from_a, double gate,
                  double radius, std::size_t max_samples, bool are_printed) {
  double const score = check_pose(a.level(1), b.level(1), b_from_a, gate, max_samples).score();
  return are_printed && score > 0 ? score * agreement(print_likeness(a, b, b_from_a, gate, radius), score) : score;
}

PoseCheck check_pose(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a, double gate,
                     std::size_t max_samples) {
  PoseCheck check;
  std::size_t of_a = 0, of_b = 0;
  check_one_way(a, b, b_from_a, gate, max_samples, check, of_a);
  check_one_way(b, a, b_from_a.inverse(), gate, max_samples, check, of_b);
  check.fewer = std::min(of_a, of_b);
  return check;
}

PairPose search_pair(SurfacePyramid const& a, SurfacePyramid const& b,
                     std::vector<std::pair<Features const*, Features const*>> const& features,
                     std::vector<Eigen::Isometry3d> const& starts, PairSearchOptions const& options) {
  PairPose best;
  if (a.depths == 0 || b.depths == 0) return best;
  double const radius = options.radius, gate = kCoarseGate * radius;
  std::vector<Candidate> candidates;
  for (auto const& [of_a, of_b] : features) {
    std::vector<Candidate> some;
    add_poses(*of_a, *of_b, options, some);
    keep_best(some, kMostPoses);
    candidates.insert(candidates.end(), some.begin(), some.end());
  }
  for (Eigen::Isometry3d const& start : starts) candidates.push_back({start, 0});
  auto const score_all = [&](std::size_t level, double within, std::size_t samples) {
    for (Candidate& candidate : candidates)
      candidate.score = check_pose(a.level(level), b.level(level), candidate.b_from_a, within, samples).score();
  };
  score_all(2, gate, kFewSamples);
  keep_best(candidates, 4 * kLookedAt);
  score_all(2, gate, kSomeSamples);
  keep_distinct(candidates, kLookedAt, a.centroid, radius);
  for (Candidate& candidate : candidates)
    refine(a.level(2), b.level(2), a, b, 2 * gate, gate, 3, kFewSamples, radius, candidate.b_from_a);
  score_all(2, 0.6 * gate, kSomeSamples);
  keep_distinct(candidates, kRefined, a.centroid, radius);
  for (Candidate& candidate : candidates)
    refine(a.level(2), b.level(2), a, b, 2.5 * gate, 0.4 * gate, 15, kSomeSamples, radius, candidate.b_from_a);
  bool const are_printed = has_print(a) && has_print(b);
  score_all(1, 0.4 * gate, kManySamples);
  if (are_printed)
    for (Candidate& candidate : candidates)
      candidate.score *= agreement(print_likeness(a, b, candidate.b_from_a, 0.4 * gate, radius), candidate.score);
  keep_distinct(candidates, kFinal, a.centroid, radius);
  double best_score = -std::numeric_limits<double>::infinity();
  for (Candidate& candidate : candidates) {
    Misfit const misfit =
        refine(a.level(1), b.level(1), a, b, gate, 0.15 * gate, 15, kManySamples, radius, candidate.b_from_a);
    double const within = std::clamp(4 * misfit.distance, 0.2 * gate, 0.6 * gate);
    PoseCheck const check = check_pose(a.level(1), b.level(1), candidate.b_from_a, within, kManySamples);
    double const likeness = are_printed ? print_likeness(a, b, candidate.b_from_a, 0.2 * gate, radius) : 1;
    double const score = check.score() * agreement(likeness, check.score());
    if (score <= best_score) continue;
    best_score = score;
    best = {candidate.b_from_a, check, misfit.in_sigmas, misfit.distance, likeness, PairPose::Verdict::refused, {}};
  }
  for (Candidate const& candidate : candidates)
    if (!is_same(candidate.b_from_a, best.b_from_a, a.centroid, radius)) best.others.push_back(candidate.b_from_a);
  best.verdict = judge(best, are_printed);
  return best;
}

}  // namespace scanview
