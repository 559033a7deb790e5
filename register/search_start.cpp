#include "register/search_start.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <map>

#include "base/median.h"
#include "base/parallel.h"
#include "register/assembly.h"
#include "register/joint_refinement.h"
#include "register/pair_search.h"
#include "register/shape_features.h"
#include "register/view_graph.h"

namespace scanview {
namespace {

constexpr double kAgreement = 0.2;           // of the radius: links that say the same
constexpr double kLinkAccuracy = 0.01;       // of the radius: what a link may be off
constexpr double kLoneContradiction = 0.07;  // of a weak link that no triangle confirms
// Deviation of a link's least held motion, of the radius: right links of the narrowest overlaps have 0.005, smooth
// patches that lie on each other by chance 0.04.
constexpr double kHeld = 0.015;
constexpr double kMostMisfit = 1.6;         // of the usual link's
constexpr std::size_t kAllPairs = 30;       // views of which every pair is searched
constexpr std::size_t kFewestSteps = 3;     // neighbours on each side, of more views
constexpr double kNear = 0.1, kWide = 0.2;  // radii: neighbourhoods of shape features
constexpr double kApart = 4;                // radii between parts

struct Link {
  std::size_t a = 0, b = 0;
  PairPose pose;
};

bool is_firm(PairPose const& pose) { return pose.verdict == PairPose::Verdict::firm; }

// How firmly the samples hold a link, as a mean form.
PairMeasurement measurement_of(Link const& link, std::vector<SurfacePyramid> const& views, double radius) {
  PairMeasurement pair;
  pair.a = link.a;
  pair.b = link.b;
  pair.b_from_a = link.pose.b_from_a;
  MatchOptions options;
  options.radius = radius;
  options.gate = 0.02 * radius;
  options.max_samples = 1000;
  options.use = MatchOptions::Use::shape;
  options.hold_free_motions = false;
  options.geometry_scale = std::max(0.05, link.pose.misfit);
  PairForm const form = match_pair(views[link.a].level(1), views[link.b].level(1), pair.b_from_a,
                                   views[link.a].centroid, views[link.b].centroid, options);
  pair.center = form.center;
  double const trace = form.information.trace();
  if (trace > 0) pair.information = form.information * (6 / trace) / (kLinkAccuracy * kLinkAccuracy * radius * radius);
  return pair;
}

class Search {
 public:
  Search(ScanSet const& set, std::vector<SurfacePyramid> const& views, double radius, Context& context)
      : set_(set), views_(views), radius_(radius), context_(context) {}

  SearchStart run() {
    describe();
    search();
    drop_unusual();
    drop_by_triangles();
    drop_unconfirmed();
    return place();
  }

 private:
  void describe() {
    for (auto* const features : {&near_, &wide_, &color_}) features->resize(views_.size());
    for_each_index(
        context_, views_.size(),
        [&](std::size_t i) {
          if (views_[i].depths == 0) return;
          ShapeFeatureOptions options;
          options.radius = radius_;
          options.neighbourhood = kNear;
          near_[i] = find_shape_features(views_[i].level(1), options);
          options.neighbourhood = kWide;
          wide_[i] = find_shape_features(views_[i].level(1), options);
          if (!views_[i].levels[0].tone.empty()) color_[i] = find_features(set_.views[i].image, views_[i].levels[0]);
        },
        "register: features");
  }

  void search() {
    std::size_t const n = views_.size();
    bool const all = n <= kAllPairs;
    for (std::size_t first = 1; first < n;) {
      std::size_t const last = all ? n - 1 : std::max(kFewestSteps, first);
      std::vector<Link> found;
      for (std::size_t step = first; step <= last; ++step)
        for (std::size_t i = 0; i + step < n; ++i) found.push_back({i, i + step, {}});
      // A turntable comes round: the last views are neighbours of the first.
      if (!all)
        for (std::size_t step = first; step <= last; ++step)
          for (std::size_t i = 0; i < step && n - step + i > i + last; ++i) found.push_back({i, n - step + i, {}});
      for_each_index(
          context_, found.size(), [&](std::size_t k) { found[k].pose = search_one(found[k].a, found[k].b); },
          "register: search");
      for (Link const& link : found) {
        hypotheses_.push_back({link.a, link.b, link.pose.others});
        hypotheses_.back().b_from_a.push_back(link.pose.b_from_a);
      }
      for (Link const& link : found)
        if (link.pose.verdict != PairPose::Verdict::refused && !known(link.a, link.b)) links_.push_back(link);
      if (joined()) return;
      first = last + 1;
    }
  }

  PairPose search_one(std::size_t a, std::size_t b) const {
    PairSearchOptions options;
    options.radius = radius_;
    std::vector<std::pair<Features const*, Features const*>> features = {{&near_[a], &near_[b]}};
    if (!color_[a].points.empty() && !color_[b].points.empty()) features.emplace_back(&color_[a], &color_[b]);
    PairPose const pose = search_pair(views_[a], views_[b], features, {}, options);
    // Where surfaces are smooth, or the overlap is narrow, the wider surroundings tell more.
    if (is_firm(pose)) return pose;
    PairPose const other = search_pair(views_[a], views_[b], {{&wide_[a], &wide_[b]}}, {}, options);
    PairPose best = is_firm(other) || other.check.score() > pose.check.score() ? other : pose;
    PairPose const& less = best.b_from_a.isApprox(pose.b_from_a) ? other : pose;
    best.others.insert(best.others.end(), less.others.begin(), less.others.end());
    best.others.push_back(less.b_from_a);
    return best;
  }

  bool known(std::size_t a, std::size_t b) const {
    return std::any_of(links_.begin(), links_.end(), [&](Link const& l) { return l.a == a && l.b == b; });
  }

  bool joined() const {
    std::vector<ViewGraphEdge> edges;
    for (Link const& link : links_)
      if (is_firm(link.pose)) edges.push_back({link.a, link.b, 0, 0});
    std::size_t with_depths = 0;
    for (SurfacePyramid const& view : views_) with_depths += view.depths > 0 ? 1 : 0;
    return connected_parts(views_.size(), edges).front().size() >= with_depths;
  }

  // All links of a set see the same noise.
  void drop_unusual() {
    std::vector<double> misfits;
    for (Link const& link : links_)
      if (is_firm(link.pose)) misfits.push_back(link.pose.misfit);
    if (misfits.size() < 3) return;
    double const most = kMostMisfit * median(misfits);
    std::erase_if(links_, [&](Link const& link) {
      if (!is_firm(link.pose) || link.pose.misfit <= most) return false;
      drop(link, fmt::format("they lie {:.1f} times as far apart as usual", link.pose.misfit / most * kMostMisfit));
      return true;
    });
  }

  void drop(Link const& link, std::string const& why) {
    context_.log(
        fmt::format("the link of {} and {} is dropped: {}", set_.views[link.a].name, set_.views[link.b].name, why));
  }

  // Open triangles less closed ones, of every link. A triangle counts as much as its weaker other link, against this
  // one's own strength.
  std::vector<double> balances() const {
    struct Step {
      Eigen::Isometry3d motion;
      double strength;
    };
    std::map<std::pair<std::size_t, std::size_t>, Step> motion;
    for (Link const& link : links_) {
      motion[{link.a, link.b}] = {link.pose.b_from_a, link.pose.strength()};
      motion[{link.b, link.a}] = {link.pose.b_from_a.inverse(), link.pose.strength()};
    }
    std::vector<double> balances(links_.size(), 0);
    for (std::size_t k = 0; k < links_.size(); ++k) {
      Link const& link = links_[k];
      for (std::size_t c = 0; c < views_.size(); ++c) {
        auto const there = motion.find({link.a, c}), on = motion.find({c, link.b});
        if (there == motion.end() || on == motion.end()) continue;
        bool const closes = motion_difference(on->second.motion * there->second.motion, link.pose.b_from_a,
                                              views_[link.a].centroid, radius_) < kAgreement * radius_;
        double const weight =
            std::min(there->second.strength, on->second.strength) / std::max(link.pose.strength(), 1e-9);
        balances[k] += closes ? -weight : weight;
      }
    }
    return balances;
  }

  // The worst first, since a wrong link spoils the triangles of right ones; of equals the one that fits worse.
  void drop_by_triangles() {
    for (;;) {
      std::vector<double> const balance = balances();
      std::size_t worst = 0;
      for (std::size_t k = 1; k < links_.size(); ++k) {
        double const here = links_[k].pose.check.contradiction(), there = links_[worst].pose.check.contradiction();
        if (std::pair(balance[k], here) > std::pair(balance[worst], there)) worst = k;
      }
      if (links_.empty() || balance[worst] <= 0) return;
      drop(links_[worst],
           fmt::format("triangles with other links contradict it ({:.1f} more than confirm it)", balance[worst]));
      links_.erase(links_.begin() + static_cast<std::ptrdiff_t>(worst));
    }
  }

  // Whether the surfaces hold the pose of a link: smooth ones lie on each other in many.
  bool is_held(Link const& link) const {
    MatchOptions options;
    options.radius = radius_;
    options.gate = std::max(0.01 * radius_, 5 * link.pose.distance);
    options.max_samples = 1500;
    options.geometry_scale = std::max(0.05, link.pose.misfit);
    options.hold_free_motions = false;
    auto const match = [&] {
      return match_pair(views_[link.a].level(1), views_[link.b].level(1), link.pose.b_from_a, views_[link.a].centroid,
                        views_[link.b].centroid, options);
    };
    PairForm const first = match();
    options.geometry_share = effective_share(first.geometry.correlation());
    options.tone_share = effective_share(first.tone.correlation());
    if (!first.tone.values.empty()) {
      std::vector<float> tones = first.tone.values;
      options.tone_scale = std::max(0.01, robust_scale(tones));
    }
    Eigen::SelfAdjointEigenSolver<Matrix6d> const spectrum(match().information);
    return spectrum.eigenvalues()[0] > 1 / std::pow(kHeld * radius_, 2);
  }

  // Weak links stay where a triangle closes, or where nothing else joins two views and little contradicts them.
  void drop_unconfirmed() {
    std::vector<double> const balance = balances();
    std::vector<Link> kept, open;
    for (std::size_t k = 0; k < links_.size(); ++k)
      (balance[k] < 0 || (is_firm(links_[k].pose) && is_held(links_[k])) ? kept : open).push_back(links_[k]);
    std::stable_sort(open.begin(), open.end(), [](Link const& l, Link const& r) {
      return l.pose.check.contradiction() < r.pose.check.contradiction();
    });
    for (Link const& link : open) {
      std::vector<ViewGraphEdge> edges;
      for (Link const& other : kept) edges.push_back({other.a, other.b, 0, 0});
      std::size_t const before = connected_parts(views_.size(), edges).size();
      edges.push_back({link.a, link.b, 0, 0});
      bool const joins = connected_parts(views_.size(), edges).size() < before;
      if (joins && views_.size() > 2 && link.pose.check.contradiction() < kLoneContradiction)
        kept.push_back(link);
      else
        drop(link, "it contradicts what the views saw, and no triangle confirms it");
    }
    links_ = std::move(kept);
  }

  SearchStart place() {
    std::size_t const n = views_.size();
    std::stable_sort(links_.begin(), links_.end(),
                     [](Link const& l, Link const& r) { return l.pose.strength() > r.pose.strength(); });
    SearchStart start;
    start.object_from_camera.assign(n, Eigen::Isometry3d::Identity());
    auto& poses = start.object_from_camera;
    std::vector<PairMeasurement> measured;
    for (Link const& link : links_) measured.push_back(measurement_of(link, views_, radius_));
    std::vector<ViewGraphEdge> tree;
    for (std::size_t const k : place_along(measured, poses)) tree.push_back({links_[k].a, links_[k].b, 0, 0});
    start.parts = connected_parts(n, tree);

    JointProblem problem;
    problem.radius = radius_;
    problem.object_from_camera = poses;
    problem.fixed.assign(n, false);
    for (auto const& views_of_part : start.parts) problem.fixed[views_of_part.front()] = true;
    for (SurfacePyramid const& view : views_) problem.centroids.push_back(view.centroid);
    for (std::size_t k = 0; k < links_.size(); ++k) {
      Link const& link = links_[k];
      Eigen::Isometry3d const b_from_a = poses[link.b].inverse() * poses[link.a];
      if (motion_difference(link.pose.b_from_a, b_from_a, views_[link.a].centroid, radius_) < kAgreement * radius_)
        problem.pairs.push_back(measured[k]);
      else
        drop(link, "it contradicts firmer ones");
    }
    start.links = problem.pairs.size();
    poses = solve_joint(problem, joint_spectrum(problem), PairLoss::cauchy).object_from_camera;
    reconsider(tree, poses);
    for (std::size_t p = 1; p < start.parts.size(); ++p) {
      Eigen::Isometry3d const aside(
          Eigen::Translation3d(kApart * radius_ * static_cast<double>(p) * Eigen::Vector3d::UnitX()));
      for (std::size_t i : start.parts[p]) poses[i] = aside * poses[i];
    }
    context_.log(fmt::format("search: {} pairs of views fit and agree, {} parts", start.links, start.parts.size()));
    return start;
  }

  void reconsider(std::vector<ViewGraphEdge> const& tree, std::vector<Eigen::Isometry3d>& poses) {
    std::vector<double> distances;
    for (Link const& link : links_) distances.push_back(link.pose.distance);
    if (distances.empty() || views_.size() > kAllPairs) return;
    AssemblyOptions options;
    options.radius = radius_;
    options.gate = std::clamp(4 * median(distances), 0.01 * radius_, 0.03 * radius_);
    for (auto const& part : connected_parts(views_.size(), tree)) {
      std::vector<std::pair<std::size_t, std::size_t>> joins;
      for (ViewGraphEdge const& edge : tree)
        if (std::find(part.begin(), part.end(), edge.a) != part.end()) joins.emplace_back(edge.a, edge.b);
      for (AmbiguousBlock const& block : improve_assembly(views_, hypotheses_, joins, options, poses, context_)) {
        std::string who;
        for (std::size_t const view : block.views) who += (who.empty() ? "" : ", ") + set_.views[view].name;
        context_.warn(fmt::format("{} would fit the other views as well turned by {:.0f} degrees: nothing tells which",
                                  who, block.turn_deg));
      }
    }
  }

  ScanSet const& set_;
  std::vector<SurfacePyramid> const& views_;
  double radius_;
  Context& context_;
  std::vector<PairHypotheses> hypotheses_;
  std::vector<Features> near_, wide_, color_;  // of shape by neighbourhood, and of colour
  std::vector<Link> links_;
};

}  // namespace

bool SearchStart::joins(std::vector<SurfacePyramid> const& views) const {
  std::size_t const with_depths = static_cast<std::size_t>(
      std::count_if(views.begin(), views.end(), [](SurfacePyramid const& view) { return view.depths > 0; }));
  return !parts.empty() && parts.front().size() >= with_depths && with_depths > 1;
}

SearchStart start_from_search(ScanSet const& set, std::vector<SurfacePyramid> const& views, double radius,
                              Context& context) {
  return Search(set, views, radius, context).run();
}

}  // namespace scanview
