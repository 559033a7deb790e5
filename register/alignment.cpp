#include "register/alignment.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "base/error.h"
#include "base/parallel.h"
#include "register/alignment_figures.h"
#include "register/joint_refinement.h"
#include "register/pair_search.h"
#include "register/pairwise_start.h"
#include "register/search_start.h"
#include "register/turntable.h"
#include "register/view_graph.h"

namespace scanview {
namespace {

constexpr double kMinScale = 1e-3;  // of residuals, in sigmas: views may agree perfectly
constexpr double kMinToneScale = 5e-3;
constexpr double kSettledStep = 0.1;                                    // of a pose's own standard deviation
constexpr std::size_t kSamplesOfSet = 6000000, kPairSamples = 6000000;  // memory and time of a round
constexpr std::size_t kFewSamples = 6000;                               // of a pair, while poses still move
constexpr double kSharedErrors = 0.3;  // correlation of neighbouring samples: more of them tell nothing new
constexpr std::size_t kManyViews = 60, kEdgesOfMany = 12;  // of so many, each is matched with its nearest only
constexpr int kReturns = 3;                                // of what nothing holds to where it was told to be
constexpr double kReturned = 0.02;                         // of a pixel
constexpr int kScaleRounds = 4;  // of a level, in which scales, gates and neighbours are still measured
// Of pairs that are right, contradictions stay below 0.15 whatever the sensor (pair_search.cpp); a small misfit excuses
// the flying pixels of outlines.
constexpr double kMostContradiction = 0.2, kMostMisfit = 2.5;
constexpr double kSurelyTorn = 10;  // mean square of a pair's wish in its deviations: chance does not give that
constexpr double kContradictionGate = 0.03;  // radii

// What one linearisation measured over all pairs; the next one weighs by it.
struct Scales {
  double geometry = 0, tone = 0;                          // 0: not measured yet
  double geometry_correlation = 0, tone_correlation = 0;  // of neighbouring residuals
  double distance = 0;                                    // robust standard deviation, units
};

class Aligner {
 public:
  Aligner(ScanSet const& set, RegisterOptions const& options, Context& context)
      : set_(set), options_(options), context_(context) {}

  Alignment run() {
    prepare();
    initial_poses();
    if (options_.refine && set_.views.size() > 1) {
      std::vector<Eigen::Isometry3d> const told = problem_.object_from_camera;
      if (!has_searched_) start_from_neighbours();
      refine();
      for (int round = 0; round < kReturns && !has_searched_ && return_along_free_motions(told); ++round) refine();
    } else {
      update_graph(0, 0.1 * radius_);
      problem_.fixed = fixed_views();
    }
    figures();
    return result_;
  }

 private:
  ScanSet const& set_;
  RegisterOptions const& options_;
  Context& context_;
  std::vector<SurfacePyramid> views_;
  double radius_ = 1;
  std::size_t coarsest_ = 0;
  JointProblem problem_;
  ViewGraph graph_;
  Scales scales_;
  /// A pair's own scales, where they exceed everybody's: pairs that stand apart would else be taken for outliers as a
  /// whole, and a tear would never heal.
  std::map<std::pair<std::size_t, std::size_t>, Scales> pair_scales_;
  Alignment result_;
  bool has_searched_ = false;
  bool uses_all_ = false;  ///< of the finest level's samples

  ViewSurface const& surface(std::size_t view, std::size_t level) const { return views_[view].level(level); }

  void prepare() {
    views_.resize(set_.views.size());
    for_each_index(
        context_, views_.size(),
        [&](std::size_t i) {
          views_[i] = build_pyramid(set_.views[i].image,
                                    {options_.levels, std::max<std::size_t>(12000, kSamplesOfSet / views_.size())});
        },
        "register: surfaces");
    std::vector<double> radii;
    for (SurfacePyramid const& view : views_) {
      problem_.centroids.push_back(view.centroid);
      coarsest_ = std::max(coarsest_, view.levels.size() - 1);
      if (view.radius > 0) radii.push_back(view.radius);
    }
    if (radii.empty()) throw Error(ErrorCode::bad_input, {}, "no view has depths to register");
    std::nth_element(radii.begin(), radii.begin() + static_cast<std::ptrdiff_t>(radii.size() / 2), radii.end());
    radius_ = radii[radii.size() / 2];
    problem_.radius = radius_;
  }

  void initial_poses() {
    auto& poses = problem_.object_from_camera;
    switch (options_.init) {
      case RegisterOptions::Init::given:
        for (View const& view : set_.views) {
          if (!view.object_from_camera)
            throw Error(ErrorCode::bad_input, {}, "view " + view.name + " has no pose to start from");
          poses.push_back(*view.object_from_camera);
        }
        problem_.believed = poses;
        problem_.belief_std = options_.given_std * radius_;
        break;
      case RegisterOptions::Init::automatic:
        search_poses();
        break;
      case RegisterOptions::Init::none:
        poses.assign(set_.views.size(), Eigen::Isometry3d::Identity());
        break;
      case RegisterOptions::Init::turntable: {
        // What joins all the views needs no belief in equal steps.
        if (options_.turntable_step_deg == 0 && options_.turntable_axis.isZero() && search_poses()) break;
        has_searched_ = false;
        Turntable const table =
            fit_turntable(views_, {options_.turntable_step_deg, options_.turntable_axis, radius_}, context_);
        context_.log(fmt::format("turntable: step {:.3f} deg about ({:.3f}, {:.3f}, {:.3f}), cost {:.3f}",
                                 table.step_deg, table.axis.x(), table.axis.y(), table.axis.z(), table.cost));
        poses = table.object_from_camera(set_.views.size());
        break;
      }
    }
  }

  /// Whether the search joins all views.
  bool search_poses() {
    SearchStart const start = start_from_search(set_, views_, radius_, context_);
    problem_.object_from_camera = start.object_from_camera;
    has_searched_ = true;
    return start.joins(views_);
  }

  void update_graph(std::size_t level, double gate) {
    std::vector<ViewSurface const*> surfaces;
    for (std::size_t i = 0; i < views_.size(); ++i) surfaces.push_back(&surface(i, level));
    MatchOptions match;
    match.gate = gate;
    match.radius = radius_;
    match.max_samples = 3000;
    graph_ = build_view_graph(surfaces, problem_.object_from_camera, options_.min_overlap, match, context_);
    if (views_.size() > kManyViews) graph_.edges = strongest_edges(views_.size(), graph_.edges, kEdgesOfMany);
  }

  // The first view of every part stays.
  std::vector<bool> fixed_views() const {
    std::vector<bool> fixed(views_.size(), false);
    for (auto const& part : graph_.parts) fixed[part.front()] = true;
    return fixed;
  }

  void start_from_neighbours() {
    for (int round = 0; round < 2; ++round) {
      update_graph(std::min<std::size_t>(1, coarsest_), (round == 0 ? 0.25 : 0.1) * radius_);
      std::vector<ViewGraphEdge> edges = strongest_edges(views_.size(), graph_.edges, 4);
      // Views taken one after the other are neighbours even where rough poses tear them apart.
      for (std::size_t i = 0; i + 1 < views_.size(); ++i) {
        bool const there =
            std::any_of(edges.begin(), edges.end(), [&](ViewGraphEdge const& e) { return e.a == i && e.b == i + 1; });
        bool const apart = options_.init != RegisterOptions::Init::given || graph_.parts.size() > 1;
        if (!there && apart && views_[i].depths && views_[i + 1].depths) edges.push_back({i, i + 1, 0, 0});
      }
      if (edges.empty()) return;
      graph_.parts = connected_parts(views_.size(), edges);
      problem_.fixed = fixed_views();
      problem_.object_from_camera = start_from_pairs(set_, views_, edges, problem_, context_);
      if (options_.init == RegisterOptions::Init::given) return;
    }
  }

  // All pairs matched at the present poses; measures the scales for the next time, unless they are to stay: poses and
  // scales that follow each other (views that drift apart loosen the scale which held them) never come to rest.
  enum class ScaleUse { measure, keep };
  std::vector<PairForm> match_all(std::size_t level, double gate, ScaleUse use = ScaleUse::measure) {
    MatchOptions match;
    match.gate = gate;
    match.radius = radius_;
    match.min_normal_cos = level > 0 ? 0.6 : 0.7;
    // Many pairs that say the same need not say it with all their samples.
    std::size_t const pairs = std::max<std::size_t>(1, graph_.edges.size());
    match.max_samples = std::clamp<std::size_t>(level > 0 ? 240000 / pairs : 480000 / pairs, 1500,
                                                level > 0 ? kFewSamples / 2 : kFewSamples);
    if (uses_all_) match.max_samples = std::max(match.max_samples, kPairSamples / pairs);
    if (options_.max_correspondences > 0)
      match.max_samples = std::min(match.max_samples, static_cast<std::size_t>(options_.max_correspondences));
    match.is_near = uses_all_;
    if (scales_.geometry > 0) match.geometry_scale = scales_.geometry;
    if (scales_.tone > 0) match.tone_scale = scales_.tone;
    match.geometry_share = effective_share(scales_.geometry_correlation);
    // A shift between colour and depth, or a warp of the depth, moves tones over wide areas as well; but their
    // residuals change sign with the print and hardly show it: so their share is the geometric mean with the shape's at
    // most.
    double const tone_share = effective_share(scales_.tone_correlation);
    match.tone_share = std::min(tone_share, std::sqrt(tone_share * match.geometry_share));
    std::vector<PairForm> forms(graph_.edges.size());
    for_each_index(context_, forms.size(), [&](std::size_t e) {
      ViewGraphEdge const& edge = graph_.edges[e];
      Eigen::Isometry3d const b_from_a =
          problem_.object_from_camera[edge.b].inverse() * problem_.object_from_camera[edge.a];
      MatchOptions own = match;
      own.geometry_share *= edge.independent;
      own.tone_share *= edge.independent;
      if (auto const known = pair_scales_.find({edge.a, edge.b}); known != pair_scales_.end()) {
        own.geometry_scale = std::max(own.geometry_scale, known->second.geometry);
        own.gate = std::clamp(5 * known->second.distance, own.gate, std::max(own.gate, 0.1 * radius_));
      }
      forms[e] = match_pair(surface(edge.a, level), surface(edge.b, level), b_from_a, views_[edge.a].centroid,
                            views_[edge.b].centroid, own);
    });
    if (use == ScaleUse::keep) return forms;
    for (std::size_t e = 0; e < forms.size(); ++e) {
      std::vector<float> in_sigmas = forms[e].geometry.values, in_units = forms[e].distances;
      Scales& own = pair_scales_[{graph_.edges[e].a, graph_.edges[e].b}];
      own.geometry = robust_scale(in_sigmas);
      own.distance = robust_scale(in_units);
    }
    ResidualFigures geometry, tone;
    std::vector<float> distances;
    auto const append = [](ResidualFigures& all, ResidualFigures const& one) {
      all.values.insert(all.values.end(), one.values.begin(), one.values.end());
      all.product += one.product;
      all.square += one.square;
    };
    for (PairForm const& form : forms) {
      append(geometry, form.geometry);
      if (form.tone_correlation > 0.2) append(tone, form.tone);
      distances.insert(distances.end(), form.distances.begin(), form.distances.end());
    }
    scales_.geometry = std::max(kMinScale, robust_scale(geometry.values));
    scales_.geometry_correlation = geometry.correlation();
    scales_.tone = tone.values.empty() ? 0 : std::max(kMinToneScale, robust_scale(tone.values));
    scales_.tone_correlation = tone.correlation();
    scales_.distance = robust_scale(distances);
    return forms;
  }

  void set_pairs(std::vector<PairForm> const& forms) {
    problem_.pairs.clear();
    for (std::size_t e = 0; e < forms.size(); ++e) {
      ViewGraphEdge const& edge = graph_.edges[e];
      problem_.pairs.push_back({edge.a, edge.b,
                                problem_.object_from_camera[edge.b].inverse() * problem_.object_from_camera[edge.a],
                                forms[e].information, forms[e].gradient, forms[e].center});
    }
  }

  double median_pixel(std::size_t level) const {
    std::vector<double> sizes;
    for (std::size_t i = 0; i < views_.size(); ++i)
      if (views_[i].depths > 0) sizes.push_back(surface(i, level).camera.pixel_size(views_[i].centroid.z()));
    std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
    return sizes[sizes.size() / 2];
  }

  // How much of a step is taken: less where it takes back the one before (each linearisation goes too far where tones
  // are steeper than their smoothed gradients), so that the two do not take turns; more where steps creep on in one
  // direction, as robust weights make them.
  double step_share(JointStep const& last, JointStep const& step, double share) const {
    if (last.twists.empty()) return 1;
    double product = 0, squares = 0, own = 0;
    for (std::size_t i = 0; i < step.twists.size(); ++i) {
      product += last.twists[i].dot(step.twists[i]);
      squares += last.twists[i].squaredNorm();
      own += step.twists[i].squaredNorm();
    }
    if (product < -0.25 * squares) return std::max(0.25, share / 2);
    bool const creeps = product > 0.8 * std::sqrt(squares * own) && own > 0.25 * squares;
    return std::min(creeps ? 2.0 : 1.0, share * 1.25);
  }

  void take(JointStep const& step, double share) {
    for (std::size_t i = 0; i < step.twists.size(); ++i)
      problem_.object_from_camera[i] =
          problem_.object_from_camera[i] * motion(share * step.twists[i], views_[i].centroid, radius_);
  }

  // The largest step of a view, turn or slide, in its own standard deviations.
  double in_deviations(JointStep const& step, JointSpectrum const& spectrum) const {
    double largest = 0;
    for (std::size_t i = 0; i < step.twists.size(); ++i)
      for (int part : {0, 3}) {
        auto const at = static_cast<Eigen::Index>(6 * i) + part;
        double const variance = spectrum.covariance.block<3, 3>(at, at).trace();
        if (variance > 0) largest = std::max(largest, step.twists[i].segment<3>(part).norm() / std::sqrt(variance));
      }
    return largest;
  }

  void refine() {
    double gate = 0.1 * radius_;
    result_.status = AlignmentStatus::not_converged;
    // Every pixel counts once the poses hardly move: the error falls with the square root of their number, where they
    // do not share their errors.
    for (std::size_t stage = coarsest_ + 2; stage-- > 0;) {
      bool const few_are_enough =
          options_.max_correspondences > 0 && static_cast<std::size_t>(options_.max_correspondences) <= kFewSamples;
      if (stage == 0 && (scales_.geometry_correlation > kSharedErrors || few_are_enough)) break;
      std::size_t const level = stage > 0 ? stage - 1 : 0;
      uses_all_ = stage == 0;
      double const pixel = median_pixel(level);
      int const rounds = level > 0 ? std::max(2, options_.max_iterations / 8) : options_.max_iterations;
      if (!uses_all_) {
        scales_ = {};
        pair_scales_.clear();
      }
      JointStep last;
      double share = 1, last_deviations = 0;
      for (int round = 0; round < rounds && result_.iterations < options_.max_iterations; ++round) {
        context_.check_cancelled();
        bool const measures = round < (uses_all_ ? 1 : kScaleRounds);
        if (round % kScaleRounds == 0 && round <= kScaleRounds && !uses_all_) {
          update_graph(std::max<std::size_t>(level, std::min<std::size_t>(1, coarsest_)), gate);
          problem_.fixed = fixed_views();
          if (graph_.edges.empty()) return;
        }
        if ((round == 0 || round == kScaleRounds) && !uses_all_) match_all(level, gate);  // the scales
        if (measures) gate = std::clamp(5 * scales_.distance, std::min(gate, 1.5 * pixel), gate);
        set_pairs(match_all(level, gate, measures ? ScaleUse::measure : ScaleUse::keep));
        JointSpectrum const spectrum = joint_spectrum(problem_);
        JointStep step = solve_joint(problem_, spectrum, PairLoss::quadratic);
        share = step_share(last, step, share);
        double const deviations = in_deviations(step, spectrum);
        take(step, share);
        last = step;
        ++result_.iterations;
        context_.log(
            fmt::format("refine: level {}, {} pairs, largest step {:.3g} ({:.3g} std, {:.2f} taken), gain {:.3g}, "
                        "distances {:.3g} (neighbours correlate {:.2f}), tones {:.3g} ({:.2f}), gate {:.3g}",
                        level, graph_.edges.size(), step.largest, deviations, share, step.gain, scales_.distance,
                        scales_.geometry_correlation, scales_.tone, scales_.tone_correlation, gate));
        context_.progress("register: refine", static_cast<std::size_t>(result_.iterations),
                          static_cast<std::size_t>(options_.max_iterations));
        // Steps shrink by a steady factor: what all that follow would add up to.
        double const factor = last_deviations > 0 ? std::min(1.0, deviations / last_deviations) : 1;
        double const left = factor < 1 ? deviations * factor / (1 - factor) : deviations;
        last_deviations = share == 1 ? deviations : 0;
        // Far below what the data can tell, or far below what a pixel can.
        bool const settled = step.largest < (level > 0 ? 0.1 : 4e-4) * pixel ||
                             (std::min(deviations, left) < kSettledStep && step.largest < 0.1 * pixel);
        if (level == 0) result_.status = settled ? AlignmentStatus::converged : AlignmentStatus::not_converged;
        if (settled) break;
      }
    }
  }

  // Starts by pairs move views along what nothing holds as well. Such motions go back to where they were told to be;
  // what is held has then to be refined anew, since turns are not linear. Whether anything moved.
  bool return_along_free_motions(std::vector<Eigen::Isometry3d> const& told) {
    JointSpectrum const spectrum = joint_spectrum(problem_);
    if (graph_.edges.empty() || spectrum.free_motions.cols() == 0) return false;
    Eigen::VectorXd back = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(6 * views_.size()));
    for (auto const& part : graph_.parts) {
      Eigen::Isometry3d const moved = problem_.object_from_camera[part.front()] * told[part.front()].inverse();
      for (std::size_t i : part)
        back.segment<6>(static_cast<Eigen::Index>(6 * i)) =
            twist_of(problem_.object_from_camera[i].inverse() * moved * told[i], views_[i].centroid, radius_);
    }
    back = (spectrum.free_motions * (spectrum.free_motions.transpose() * back)).eval();
    double largest = 0;
    for (std::size_t i = 0; i < views_.size(); ++i) {
      Vector6d const twist = back.segment<6>(static_cast<Eigen::Index>(6 * i));
      largest = std::max(largest, twist.norm());
      problem_.object_from_camera[i] = problem_.object_from_camera[i] * motion(twist, views_[i].centroid, radius_);
    }
    return largest > kReturned * median_pixel(0);
  }

  std::string name(std::size_t view) const { return set_.views[view].name; }

  void figures() {
    double const gate = std::max(0.05 * radius_, 5 * scales_.distance);
    update_graph(0, gate);
    result_.object_from_camera = problem_.object_from_camera;
    result_.parts = graph_.parts;
    problem_.fixed = fixed_views();
    if (!uses_all_) match_all(0, gate);  // the scales
    std::vector<PairForm> const forms = match_all(0, std::clamp(5 * scales_.distance, 1.5 * median_pixel(0), gate));
    set_pairs(forms);
    JointSpectrum const spectrum = joint_spectrum(problem_);
    std::vector<std::string> names;
    for (View const& view : set_.views) names.push_back(view.name);
    result_.unobservable = describe_free_motions(problem_, spectrum, names);
    for (std::size_t i = 0; i < views_.size(); ++i) {
      auto const at = static_cast<Eigen::Index>(6 * i);
      PoseFigures pose;
      pose.std_deg =
          std::sqrt(std::max(0.0, spectrum.covariance.block<3, 3>(at, at).trace())) / radius_ * 180 / std::numbers::pi;
      pose.std_length = std::sqrt(std::max(0.0, spectrum.covariance.block<3, 3>(at + 3, at + 3).trace()));
      result_.poses.push_back(pose);
    }
    std::vector<PairDistances> const pairs =
        measure_pairs(set_, views_, graph_.edges, problem_.object_from_camera, gate, context_);
    result_.error = overall_error(pairs);
    for (PairDistances const& pair : pairs) result_.pairs.push_back(pair.figures);
    judge_pairs(forms);
    judge_parts();
  }

  // Do the views say that they are not of one surface? For pairs that nothing else can be compared with.
  bool contradict(PairFigures const& pair, PairForm const& form) const {
    std::vector<float> in_sigmas = form.geometry.values;
    if (!(robust_scale(in_sigmas) > kMostMisfit)) return false;
    std::size_t const level = std::min<std::size_t>(1, coarsest_);
    Eigen::Isometry3d const b_from_a =
        problem_.object_from_camera[pair.b].inverse() * problem_.object_from_camera[pair.a];
    return check_pose(surface(pair.a, level), surface(pair.b, level), b_from_a, kContradictionGate * radius_,
                      kFewSamples)
               .contradiction() > kMostContradiction;
  }

  // A pair is suspicious whose residual, or whose wish to move against what all pairs agreed on, is far above the
  // others', or whose views contradict each other.
  void judge_pairs(std::vector<PairForm> const& forms) {
    for (std::size_t e = 0; e < forms.size(); ++e) {
      PairFigures& pair = result_.pairs[e];
      if (!contradict(pair, forms[e])) continue;
      pair.suspicious = true;
      context_.warn(
          fmt::format("views {} and {} do not fit: each stands before what the other saw", name(pair.a), name(pair.b)));
    }
    if (forms.size() < 3) return;
    std::vector<double> residuals, wishes, squares;  // wishes in units, and in their deviations squared
    for (std::size_t e = 0; e < forms.size(); ++e) {
      residuals.push_back(result_.pairs[e].median_distance);
      Matrix6d information = forms[e].information;
      information.diagonal().array() += 1e-4 * information.trace() + 1e-300;
      Vector6d const wish = information.ldlt().solve(forms[e].gradient);
      wishes.push_back(wish.norm());
      squares.push_back(wish.dot(forms[e].gradient) / 6);
    }
    // The lower quartile: one wrong view of a few has half of the pairs.
    auto const usual = [](std::vector<double> values) {
      auto const quarter = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 4);
      std::nth_element(values.begin(), quarter, values.end());
      return *quarter;
    };
    double const usual_residual = usual(residuals), usual_wish = usual(wishes);
    for (std::size_t e = 0; e < forms.size(); ++e) {
      PairFigures& pair = result_.pairs[e];
      if (pair.suspicious) continue;
      bool const far = residuals[e] > 3 * usual_residual && residuals[e] > 1e-3 * radius_;
      bool const torn = wishes[e] > 6 * usual_wish && wishes[e] > 0.02 * radius_ && squares[e] > kSurelyTorn;
      pair.suspicious = far || torn;
      if (far)
        context_.warn(fmt::format("views {} and {} do not fit: median distance {:.3g} {}, of all pairs {:.3g}",
                                  name(pair.a), name(pair.b), residuals[e], to_string(set_.unit), usual_residual));
      else if (torn)
        context_.warn(fmt::format("views {} and {} disagree with the others by {:.3g} {}", name(pair.a), name(pair.b),
                                  wishes[e], to_string(set_.unit)));
    }
  }

  void judge_parts() {
    if (result_.parts.size() > 1) {
      result_.status = AlignmentStatus::disconnected;
      for (std::size_t p = 1; p < result_.parts.size(); ++p) {
        std::string who;
        for (std::size_t view : result_.parts[p]) who += (who.empty() ? "" : ", ") + name(view);
        context_.warn(fmt::format("no overlap joins {} to the other views: kept at the initial poses", who));
      }
      return;
    }
    for (std::string const& motion : result_.unobservable)
      context_.warn("the data does not hold " + motion + ": left as it was");
    if (result_.status == AlignmentStatus::not_converged && options_.refine)
      context_.warn(fmt::format("registration did not settle in {} iterations", result_.iterations));
  }
};

}  // namespace

void RegisterOptions::validate() const {
  auto const refuse = [](std::string const& why) { throw Error(ErrorCode::usage, {}, why); };
  if (!std::isfinite(turntable_step_deg) || std::abs(turntable_step_deg) > 180)
    refuse("turntable step must lie within -180 and 180 degrees");
  if (!turntable_axis.allFinite()) refuse("turntable axis must be finite");
  if (levels < 1 || levels > 12) refuse("levels must be 1 to 12");
  if (max_iterations < 1) refuse("max_iterations must be at least 1");
  if (max_correspondences != 0 && max_correspondences < 100)
    refuse("max_correspondences must be 0 (all) or at least 100");
  if (!(given_std >= 0)) refuse("given_std must not be negative");
  if (!(min_overlap > 0 && min_overlap <= 1)) refuse("min_overlap must lie above 0 and at most at 1");
}

Alignment align(ScanSet const& set, RegisterOptions const& options, Context& context) {
  options.validate();
  return Aligner(set, options, context).run();
}

}  // namespace scanview
