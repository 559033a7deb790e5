#include "register/assembly.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "base/parallel.h"
#include "register/pair_search.h"

namespace scanview {
namespace {

constexpr std::size_t kLook = 120, kFit = 300, kJudge = 500, kCount = 2000;  // samples of a view
constexpr double kLookGate = 0.05, kFitGate = 0.02;                          // radii
constexpr int kFitSteps = 6;
constexpr std::size_t kTried = 8;     // poses of a block that are fitted
constexpr double kWorthALook = 0.3;   // of what the block reaches where it is
constexpr double kSameMotion = 0.08;  // radii
constexpr double kBetter = 1.03;      // a move must gain more than chance of few samples gives
constexpr int kSweeps = 3;
constexpr double kOtherPose = 10;  // degrees: less may be the same minimum

double turn_deg(Eigen::Isometry3d const& motion) {
  return std::abs(Eigen::AngleAxisd(motion.linear()).angle()) * 180 / std::numbers::pi;
}

class Assembly {
 public:
  Assembly(std::vector<SurfacePyramid> const& views, std::vector<PairHypotheses> const& hypotheses,
           AssemblyOptions const& options, std::vector<Eigen::Isometry3d>& poses, Context& context)
      : views_(views), hypotheses_(hypotheses), options_(options), poses_(poses), context_(context) {
    for (SurfacePyramid const& view : views) printed_.push_back(has_print(view));
  }

  std::vector<AmbiguousBlock> run(std::vector<std::pair<std::size_t, std::size_t>> const& tree) {
    std::set<std::size_t> part;
    for (auto const& [a, b] : tree) part.insert({a, b});
    std::vector<std::vector<std::size_t>> blocks;
    if (part.size() > 2)
      for (std::size_t const view : part) blocks.push_back({view});
    for (std::size_t cut = 0; cut < tree.size(); ++cut) {
      std::vector<std::size_t> const side = smaller_side(tree, cut, part.size());
      if (side.size() > 1) blocks.push_back(side);
    }
    std::vector<AmbiguousBlock> ambiguous;
    for (int sweep = 0; sweep < kSweeps; ++sweep) {
      ambiguous.clear();
      std::size_t moves = 0;
      for (auto const& block : blocks) moves += improve({block, rest_of(part, block)}, ambiguous) ? 1 : 0;
      if (moves == 0) break;
    }
    return ambiguous;
  }

 private:
  struct Cut {
    std::vector<std::size_t> moving, staying;
  };

  static std::vector<std::size_t> rest_of(std::set<std::size_t> const& part, std::vector<std::size_t> const& block) {
    std::vector<std::size_t> rest;
    for (std::size_t const view : part)
      if (std::find(block.begin(), block.end(), view) == block.end()) rest.push_back(view);
    return rest;
  }

  static std::vector<std::size_t> smaller_side(std::vector<std::pair<std::size_t, std::size_t>> const& tree,
                                               std::size_t cut, std::size_t count) {
    std::set<std::size_t> side{tree[cut].first};
    for (bool grows = true; grows;) {
      grows = false;
      for (std::size_t e = 0; e < tree.size(); ++e)
        if (e != cut && side.contains(tree[e].first) != side.contains(tree[e].second)) {
          side.insert({tree[e].first, tree[e].second});
          grows = true;
        }
    }
    if (2 * side.size() <= count) return {side.begin(), side.end()};
    std::set<std::size_t> part;
    for (auto const& [a, b] : tree) part.insert({a, b});
    return rest_of(part, {side.begin(), side.end()});
  }

  Eigen::Isometry3d b_from_a(std::size_t a, std::size_t b, Eigen::Isometry3d const& move) const {
    return poses_[b].inverse() * move * poses_[a];
  }

  // The moving views together against the others, after `move` (object coordinates).
  double look(Cut const& cut, Eigen::Isometry3d const& move) const {
    double sum = 0;
    for (std::size_t const a : cut.moving)
      for (std::size_t const b : cut.staying)
        sum +=
            check_pose(views_[a].level(2), views_[b].level(2), b_from_a(a, b, move), kLookGate * options_.radius, kLook)
                .score();
    return sum;
  }

  struct Judgement {
    double score = 0;
    double in_front = 0;  // samples far before what another view saw: no noise puts a surface there

    // Symmetric surfaces fit alike either way; the few places that are not symmetric decide.
    bool is_better_than(Judgement const& other) const {
      if (score > std::max(kBetter * other.score, other.score + 1)) return true;
      return score * kBetter > other.score && in_front + 3 * std::sqrt(in_front) + 3 < other.in_front;
    }
  };

  Judgement judge(Cut const& cut, Eigen::Isometry3d const& move) const {
    Judgement sum;
    for (std::size_t const a : cut.moving)
      for (std::size_t const b : cut.staying) {
        Eigen::Isometry3d const pose = b_from_a(a, b, move);
        sum.score +=
            pose_score(views_[a], views_[b], pose, options_.gate, options_.radius, kJudge, printed_[a] && printed_[b]);
        sum.in_front += static_cast<double>(
            check_pose(views_[a].level(1), views_[b].level(1), pose, kLookGate * options_.radius, kCount).in_front);
      }
    return sum;
  }

  // Gauss-Newton of the block against all the others together.
  void fit(Cut const& cut, Eigen::Isometry3d& move) const {
    MatchOptions options;
    options.radius = options_.radius;
    options.max_samples = kFit;
    options.use = MatchOptions::Use::shape;
    options.hold_free_motions = false;
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (std::size_t const a : cut.moving)
      center += poses_[a] * views_[a].centroid / static_cast<double>(cut.moving.size());
    for (int i = 0; i < kFitSteps; ++i) {
      double const share = static_cast<double>(i) / (kFitSteps - 1);
      options.gate = kLookGate * std::pow(kFitGate / kLookGate, share) * options_.radius;
      Matrix6d information = Matrix6d::Zero();
      Vector6d gradient = Vector6d::Zero();
      std::vector<float> in_sigmas;
      Eigen::Vector3d const here = move * center;
      for (std::size_t const a : cut.moving)
        for (std::size_t const b : cut.staying) {
          PairForm const form = match_pair(views_[a].level(1), views_[b].level(1), b_from_a(a, b, move),
                                           views_[a].centroid, views_[b].centroid, options);
          if (form.hits_ab + form.hits_ba < 20) continue;
          // The form's motion is about its centre in b's frame, the block's about `here` in the object's.
          Eigen::Matrix3d const turn = poses_[b].linear().transpose();
          Eigen::Vector3d const arm = poses_[b] * form.center - here;
          Matrix6d by_block = Matrix6d::Zero();
          by_block.topLeftCorner<3, 3>() = by_block.bottomRightCorner<3, 3>() = turn;
          Eigen::Matrix3d cross;
          cross << 0, -arm.z(), arm.y(), arm.z(), 0, -arm.x(), -arm.y(), arm.x(), 0;
          by_block.bottomLeftCorner<3, 3>() = -turn * cross / options_.radius;
          information += by_block.transpose() * form.information * by_block;
          gradient += by_block.transpose() * form.gradient;
          in_sigmas.insert(in_sigmas.end(), form.geometry.values.begin(), form.geometry.values.end());
        }
      if (in_sigmas.empty()) return;
      options.geometry_scale = std::max(0.05, robust_scale(in_sigmas));
      information.diagonal().array() += 1e-4 * information.trace() + 1e-300;
      Vector6d step = -information.ldlt().solve(gradient);
      if (!step.allFinite()) return;
      double const most = 0.1 * options_.radius;
      if (step.norm() > most) step *= most / step.norm();
      move = motion(step, here, options_.radius) * move;
    }
  }

  std::vector<Eigen::Isometry3d> proposals(Cut const& cut) const {
    std::vector<Eigen::Isometry3d> moves;
    auto const add = [&](std::size_t moving, Eigen::Isometry3d const& move) {
      Eigen::Vector3d const at = poses_[moving] * views_[moving].centroid;
      auto const is_same = [&](Eigen::Isometry3d const& other) {
        return motion_difference(move, other, at, options_.radius) < kSameMotion * options_.radius;
      };
      if (!is_same(Eigen::Isometry3d::Identity()) && std::none_of(moves.begin(), moves.end(), is_same))
        moves.push_back(move);
    };
    auto const has = [](std::vector<std::size_t> const& views, std::size_t view) {
      return std::find(views.begin(), views.end(), view) != views.end();
    };
    for (PairHypotheses const& pair : hypotheses_)
      for (Eigen::Isometry3d const& pose : pair.b_from_a) {
        if (has(cut.moving, pair.a) && has(cut.staying, pair.b))
          add(pair.a, poses_[pair.b] * pose * poses_[pair.a].inverse());
        if (has(cut.moving, pair.b) && has(cut.staying, pair.a))
          add(pair.b, poses_[pair.a] * pose.inverse() * poses_[pair.b].inverse());
      }
    return moves;
  }

  bool improve(Cut const& cut, std::vector<AmbiguousBlock>& ambiguous) {
    context_.check_cancelled();
    std::vector<Eigen::Isometry3d> moves = proposals(cut);
    if (moves.empty()) return false;
    double const here = look(cut, Eigen::Isometry3d::Identity());
    std::vector<std::pair<double, std::size_t>> looks(moves.size());
    for_each_index(context_, moves.size(), [&](std::size_t k) { looks[k] = {-look(cut, moves[k]), k}; });
    std::sort(looks.begin(), looks.end());
    std::vector<Eigen::Isometry3d> tried{Eigen::Isometry3d::Identity()};
    for (auto const& [cost, k] : looks)
      if (tried.size() <= kTried && -cost > kWorthALook * here) tried.push_back(moves[k]);
    if (tried.size() < 2) return false;
    std::vector<Judgement> judged(tried.size());
    for_each_index(context_, tried.size(), [&](std::size_t k) {
      fit(cut, tried[k]);
      judged[k] = judge(cut, tried[k]);
    });
    std::size_t best = 0;
    for (std::size_t k = 1; k < tried.size(); ++k)
      if (judged[k].is_better_than(judged[best])) best = k;
    if (best == 0) {
      for (std::size_t k = 1; k < tried.size(); ++k) {
        double const turn = turn_deg(tried[k] * tried[0].inverse());
        if (turn < kOtherPose || judged[0].is_better_than(judged[k])) continue;
        ambiguous.push_back({cut.moving, turn});
        break;
      }
      return false;
    }
    for (std::size_t const view : cut.moving) poses_[view] = tried[best] * poses_[view];
    return true;
  }

  std::vector<SurfacePyramid> const& views_;
  std::vector<PairHypotheses> const& hypotheses_;
  AssemblyOptions options_;
  std::vector<Eigen::Isometry3d>& poses_;
  Context& context_;
  std::vector<bool> printed_;
};

}  // namespace

std::vector<AmbiguousBlock> improve_assembly(std::vector<SurfacePyramid> const& views,
                                             std::vector<PairHypotheses> const& hypotheses,
                                             std::vector<std::pair<std::size_t, std::size_t>> const& tree,
                                             AssemblyOptions const& options,
                                             std::vector<Eigen::Isometry3d>& object_from_camera, Context& context) {
  return Assembly(views, hypotheses, options, object_from_camera, context).run(tree);
}

}  // namespace scanview
