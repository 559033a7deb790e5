#include "calib/calibrate_problem.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <memory>

namespace scanview {
namespace {

template <typename T>
using Vector2 = Eigen::Matrix<T, 2, 1>;
template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

// A pixel through lens unknowns (DESIGN's order: fx fy cx cy k1 k2 p1 p2 k3).
template <typename T>
Vector2<T> project(T const* lens, Vector3<T> const& p) {
  T const x = p.x() / p.z(), y = p.y() / p.z(), r2 = x * x + y * y;
  T const radial = 1.0 + r2 * (lens[4] + r2 * (lens[5] + r2 * lens[8]));
  T const u = x * radial + 2.0 * lens[6] * x * y + lens[7] * (r2 + 2.0 * x * x);
  T const v = y * radial + lens[6] * (r2 + 2.0 * y * y) + 2.0 * lens[7] * x * y;
  return {lens[0] * u + lens[2], lens[1] * v + lens[3]};
}

template <typename T>
Vector3<T> move(T const* pose, Vector3<T> const& p) {
  Vector3<T> turned;
  ceres::AngleAxisRotatePoint(pose, p.data(), turned.data());
  return turned + Vector3<T>(pose[3], pose[4], pose[5]);
}

struct LeftCost {
  Eigen::Vector2d on_board, pixel;
  double weight;
  template <typename T>
  bool operator()(T const* lens, T const* pose, T* out) const {
    Vector3<T> const p = move<T>(pose, Vector3<T>(T(on_board.x()), T(on_board.y()), T(0)));
    Vector2<T> const error = weight * (project(lens, p) - pixel.cast<T>());
    out[0] = error.x();
    out[1] = error.y();
    return p.z() > T(0);
  }
};

struct RightCost {
  Eigen::Vector2d on_board, pixel;
  double weight;
  template <typename T>
  bool operator()(T const* lens, T const* rig, T const* pose, T* out) const {
    Vector3<T> const p = move<T>(rig, move<T>(pose, Vector3<T>(T(on_board.x()), T(on_board.y()), T(0))));
    Vector2<T> const error = weight * (project(lens, p) - pixel.cast<T>());
    out[0] = error.x();
    out[1] = error.y();
    return p.z() > T(0);
  }
};

ceres::CostFunction* make_cost(Observation const& o, double deviation) {
  if (o.side == Side::left)
    return new ceres::AutoDiffCostFunction<LeftCost, 2, kLensUnknowns, 6>(
        new LeftCost{o.on_board, o.pixel, 1 / deviation});
  return new ceres::AutoDiffCostFunction<RightCost, 2, kLensUnknowns, 6, 6>(
      new RightCost{o.on_board, o.pixel, 1 / deviation});
}

// Holds the marked part of a block; a block that is held as a whole is constant.
void hold(ceres::Problem& problem, double* block, int size, bool const* held) {
  if (!problem.HasParameterBlock(block)) return;
  std::vector<int> constant;
  for (int i = 0; i < size; ++i)
    if (held[i]) constant.push_back(i);
  if (static_cast<int>(constant.size()) == size)
    problem.SetParameterBlockConstant(block);
  else if (!constant.empty())
    problem.SetManifold(block, new ceres::SubsetManifold(size, constant));
}

}  // namespace

std::string shared_name(int index) {
  constexpr std::array kLens = {"fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"};
  constexpr std::array kAxes = {"x", "y", "z"};
  std::string name = index < kRight ? "left." : index < kRotation ? "right." : "rotation.";
  if (index >= kTranslation) name = "translation.";
  return index < kRotation ? name.append(kLens[static_cast<std::size_t>(index % kLensUnknowns)])
                           : name.append(kAxes[static_cast<std::size_t>((index - kRotation) % 3)]);
}

PoseVector to_vector(Eigen::Isometry3d const& pose) {
  Eigen::AngleAxisd const turn(Eigen::Matrix3d(pose.linear()));
  PoseVector vector;
  vector << turn.angle() * turn.axis(), pose.translation();
  return vector;
}

Eigen::Isometry3d to_pose(PoseVector const& vector) {
  Eigen::Isometry3d pose = Eigen::Isometry3d::Identity();
  Eigen::Vector3d const turn = vector.head<3>();
  if (double const angle = turn.norm(); angle > 0)
    pose.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  pose.translation() = vector.tail<3>();
  return pose;
}

LensCamera Estimate::camera(Side side, cv::Size size) const {
  auto const l = shared.segment<kLensUnknowns>(side == Side::left ? 0 : kRight);
  LensCamera result;
  result.camera = Camera::perspective(size.width, size.height, l[0], l[1], l[2], l[3]);
  result.lens = {l[4], l[5], l[6], l[7], l[8], 0, 0, 0};
  return result;
}

double Problem::deviation(Observation const& o) const {
  return std::max(1e-6, std::hypot(o.sigma_px, extra_px[static_cast<std::size_t>(o.side)]));
}

Eigen::Vector2d residual(Estimate const& estimate, Observation const& o) {
  double const* const shared = estimate.shared.data();
  Eigen::Vector3d p = move<double>(estimate.poses[o.board].data(), {o.on_board.x(), o.on_board.y(), 0});
  if (o.side == Side::right) p = move<double>(shared + kRotation, p);
  if (!(p.z() > 0)) return Eigen::Vector2d::Constant(std::numeric_limits<double>::quiet_NaN());
  return project<double>(shared + (o.side == Side::left ? 0 : kRight), p) - o.pixel;
}

bool solve(Problem const& problem, Estimate& estimate, SolveOptions const& options) {
  Estimate next = estimate;
  double* const left = next.shared.data();
  double* const right = left + kRight;
  double* const rig = left + kRotation;
  ceres::Problem::Options ownership;
  ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  ownership.disable_all_safety_checks = true;
  std::unique_ptr<ceres::LossFunction> const loss(
      options.cauchy_sigmas > 0 ? new ceres::CauchyLoss(options.cauchy_sigmas) : nullptr);
  ceres::Problem ceres_problem(ownership);
  for (Observation const& o : problem.observations) {
    if (!problem.uses(o)) continue;
    double* const pose = next.poses[o.board].data();
    ceres::CostFunction* const cost = make_cost(o, problem.deviation(o));
    if (o.side == Side::left)
      ceres_problem.AddResidualBlock(cost, loss.get(), left, pose);
    else
      ceres_problem.AddResidualBlock(cost, loss.get(), right, rig, pose);
  }
  if (ceres_problem.NumResidualBlocks() == 0) return false;
  std::array<bool, kShared> held = problem.held;
  if (options.poses_only) held.fill(true);
  hold(ceres_problem, left, kLensUnknowns, held.data());
  hold(ceres_problem, right, kLensUnknowns, held.data() + kRight);
  hold(ceres_problem, rig, 6, held.data() + kRotation);

  ceres::Solver::Options solver;
  solver.num_threads = 1;
  solver.logging_type = ceres::SILENT;
  solver.linear_solver_type = options.poses_only ? ceres::DENSE_QR : ceres::DENSE_SCHUR;
  if (!options.poses_only) {
    auto ordering = std::make_shared<ceres::ParameterBlockOrdering>();
    for (std::size_t i = 0; i < next.poses.size(); ++i)
      if (ceres_problem.HasParameterBlock(next.poses[i].data())) ordering->AddElementToGroup(next.poses[i].data(), 0);
    for (double* const block : {left, right, rig})
      if (ceres_problem.HasParameterBlock(block)) ordering->AddElementToGroup(block, 1);
    solver.linear_solver_ordering = ordering;
  }
  // A relative change of the cost by 1e-10 moves no parameter by a thousandth of its deviation. A robust solve only
  // prepares a verdict.
  bool const robust = options.cauchy_sigmas > 0;
  solver.max_num_iterations = robust ? 25 : 100;
  solver.function_tolerance = robust ? 1e-6 : 1e-10;
  ceres::Solver::Summary summary;
  ceres::Solve(solver, &ceres_problem, &summary);
  bool finite = summary.IsSolutionUsable() && next.shared.allFinite();
  for (PoseVector const& pose : next.poses) finite = finite && pose.allFinite();
  if (finite) estimate = std::move(next);
  return finite;
}

PoseVector solve_pose(Problem const& problem, Estimate const& estimate, std::size_t board,
                      std::vector<std::size_t> const& observations) {
  Problem one;
  one.extra_px = problem.extra_px;
  one.board_used.assign(problem.board_used.size(), false);
  one.board_used[board] = true;
  for (std::size_t const i : observations) {
    one.observations.push_back(problem.observations[i]);
    one.observations.back().corner_ok = true;
  }
  Estimate result = estimate;
  // First wide, so that a pose that is far off is not taken for outliers.
  for (double const sigmas : {0.0, 3.0}) solve(one, result, {.cauchy_sigmas = sigmas, .poses_only = true});
  return result.poses[board];
}

Covariance covariance(Problem const& problem, Estimate const& estimate) {
  using PoseMatrix = Eigen::Matrix<double, 6, 6>;
  std::size_t const boards = estimate.poses.size();
  SharedMatrix information = SharedMatrix::Zero();
  std::vector<Eigen::Matrix<double, kShared, 6>> across(boards, Eigen::Matrix<double, kShared, 6>::Zero());
  std::vector<PoseMatrix> own(boards, PoseMatrix::Zero());
  Covariance result;
  std::vector<bool> seen(boards, false);
  for (Observation const& o : problem.observations) {
    if (!problem.uses(o)) continue;
    std::unique_ptr<ceres::CostFunction> const cost(make_cost(o, problem.deviation(o)));
    double const* const shared = estimate.shared.data();
    bool const left = o.side == Side::left;
    std::vector<double const*> const blocks =
        left ? std::vector<double const*>{shared, estimate.poses[o.board].data()}
             : std::vector<double const*>{shared + kRight, shared + kRotation, estimate.poses[o.board].data()};
    Eigen::Matrix<double, 2, kLensUnknowns, Eigen::RowMajor> by_lens;
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_rig = Eigen::Matrix<double, 2, 6, Eigen::RowMajor>::Zero(), by_pose;
    std::vector<double*> derivatives = left ? std::vector<double*>{by_lens.data(), by_pose.data()}
                                            : std::vector<double*>{by_lens.data(), by_rig.data(), by_pose.data()};
    Eigen::Vector2d error;
    if (!cost->Evaluate(blocks.data(), error.data(), derivatives.data())) continue;
    Eigen::Matrix<double, 2, kShared> row = Eigen::Matrix<double, 2, kShared>::Zero();
    row.middleCols<kLensUnknowns>(left ? 0 : kRight) = by_lens;
    row.rightCols<6>() = by_rig;
    information += row.transpose() * row;
    across[o.board] += row.transpose() * by_pose;
    own[o.board] += by_pose.transpose() * by_pose;
    seen[o.board] = true;
    result.chi2 += error.squaredNorm();
    result.freedom += 2;
  }
  SharedVector const before = information.diagonal();
  for (std::size_t i = 0; i < boards; ++i) {
    if (!seen[i]) continue;
    information -= across[i] * own[i].ldlt().solve(across[i].transpose());
    result.freedom -= 6;
  }
  std::vector<int> open;
  for (int k = 0; k < kShared; ++k)
    if (!problem.held[static_cast<std::size_t>(k)]) open.push_back(k);
  Eigen::MatrixXd const part = information(open, open);
  result.freedom = std::max(1.0, result.freedom - static_cast<double>(open.size()));
  Eigen::VectorXd const scale = Eigen::VectorXd(before(open)).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> const spectrum(
      Eigen::MatrixXd(scale.asDiagonal() * part * scale.asDiagonal()));
  Eigen::MatrixXd const inverse = spectrum.eigenvectors() *
                                  spectrum.eigenvalues().cwiseMax(1e-14).cwiseInverse().asDiagonal() *
                                  spectrum.eigenvectors().transpose();
  Eigen::MatrixXd const scaled = scale.asDiagonal() * inverse * scale.asDiagonal();
  for (std::size_t i = 0; i < open.size(); ++i)
    for (std::size_t j = 0; j < open.size(); ++j)
      result.matrix(open[i], open[j]) = scaled(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
  return result;
}

}  // namespace scanview
