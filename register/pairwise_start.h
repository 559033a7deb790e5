#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "register/joint_refinement.h"
#include "register/view_graph.h"

namespace scanview {

/// Better poses from rough ones: for every edge several relative motions are tried (as it stands; ICP from there;
/// matched colour features; ICP from these), the one whose projected surfaces and tones coincide best is kept, where
/// the views contradict it a search from nothing (pair_search.h) if that is sure of itself, and all of them together
/// are balanced into poses, with a loss that doubts pairs which contradict the others. The poses that went in come back
/// where they overlap at least as well. `problem.pairs` is not read.
std::vector<Eigen::Isometry3d> start_from_pairs(ScanSet const& set, std::vector<SurfacePyramid> const& views,
                                                std::vector<ViewGraphEdge> const& edges, JointProblem const& problem,
                                                Context& context);

/// Mean of `PairForm::cost` over edges on a middle level: how badly views coincide, 0 to 1.
double mean_pair_cost(std::vector<SurfacePyramid> const& views, std::vector<ViewGraphEdge> const& edges,
                      std::vector<Eigen::Isometry3d> const& object_from_camera, double radius, Context& context);

}  // namespace scanview
