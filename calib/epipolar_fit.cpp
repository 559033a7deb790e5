#include "calib/epipolar_fit.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>

namespace scanview {
namespace {

// Unknowns: the rotation's increment (right camera's axes), the translation's in its tangent plane, log of the factor
// on the focal lengths, what is added to k1.
constexpr int kUnknowns = 7, kFocal = 5, kK1 = 6;
constexpr int kClusterColumns = 16, kClusterRows = 12;
constexpr double kTiny = 1e-18;  // keeps the Sampson distance of a match at the epipole finite

using Vector7d = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix7d = Eigen::Matrix<double, kUnknowns, kUnknowns>;

template <typename T>
using Vector2 = Eigen::Matrix<T, 2, 1>;
template <typename T>
using Vector3 = Eigen::Matrix<T, 3, 1>;

template <typename T>
Vector2<T> distort(Lens const& lens, T const& k1, Vector2<T> const& p) {
  T const r2 = p.squaredNorm(), x = p.x(), y = p.y();
  T const radial =
      (1.0 + r2 * (k1 + r2 * (lens.k2 + r2 * lens.k3))) / (1.0 + r2 * (lens.k4 + r2 * (lens.k5 + r2 * lens.k6)));
  return {x * radial + 2.0 * lens.p1 * x * y + lens.p2 * (r2 + 2.0 * x * x),
          y * radial + lens.p1 * (r2 + 2.0 * y * y) + 2.0 * lens.p2 * x * y};
}

// One pixel through one camera.
struct Sight {
  Eigen::Vector2d seen;           // normalised, as the lens bent it
  Eigen::Vector2d ideal;          // normalised, straight
  Eigen::Matrix2d ideal_by_seen;  // derivative of the one by the other
  Eigen::Matrix2d ideal_by_pixel;
  Lens const* lens = nullptr;

  Sight(LensCamera const& camera, Eigen::Vector2d const& pixel) : lens(&camera.lens) {
    seen = camera.camera.ray_direction(pixel.x(), pixel.y()).head<2>();
    ideal = camera.lens.undistort(seen);
    ideal_by_seen.setIdentity();
    if (!lens->is_ideal()) {
      using Jet = ceres::Jet<double, 2>;
      Vector2<Jet> const p(Jet(ideal.x(), 0), Jet(ideal.y(), 1));
      Vector2<Jet> const bent = distort<Jet>(*lens, Jet(lens->k1), p);
      Eigen::Matrix2d seen_by_ideal;
      seen_by_ideal << bent.x().v.transpose(), bent.y().v.transpose();
      ideal_by_seen = seen_by_ideal.inverse();
    }
    ideal_by_pixel = ideal_by_seen * Eigen::Vector2d(1 / camera.camera.fx(), 1 / camera.camera.fy()).asDiagonal();
  }

  // The straight ray under changed intrinsics: two Newton steps with the derivative of the start. The caller starts
  // again from the result, so what these steps leave does not stay.
  template <typename T>
  Vector3<T> ray(T const& log_focal, T const& k1_change) const {
    Vector2<T> const target = seen.cast<T>() * exp(-log_focal);
    Vector2<T> p = ideal.cast<T>();
    for (int step = 0; step < 2; ++step)
      p += ideal_by_seen.cast<T>() * (target - distort<T>(*lens, lens->k1 + k1_change, p));
    return p.homogeneous();
  }
};

Eigen::Matrix<double, 3, 2> tangent_plane(Eigen::Vector3d const& direction) {
  Eigen::Vector3d const a = direction.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> basis;
  basis << a, direction.cross(a);
  return basis;
}

// The pose around which the unknowns are increments.
struct PoseStart {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  Eigen::Matrix<double, 3, 2> tangent;
};

struct EpipolarCost {
  Sight left, right;
  PoseStart const* start;
  double weight;
  bool intrinsics;

  template <typename T>
  bool operator()(T const* x, T* residual) const {
    Vector3<T> const p = intrinsics ? left.ray<T>(x[kFocal], x[kK1]) : left.ideal.homogeneous().cast<T>();
    Vector3<T> const q = intrinsics ? right.ray<T>(x[kFocal], x[kK1]) : right.ideal.homogeneous().cast<T>();
    Vector3<T> const turned_first = start->rotation.cast<T>() * p;
    Vector3<T> const t = start->translation.cast<T>() + start->tangent.cast<T>() * Vector2<T>(x[3], x[4]);
    Vector3<T> turned, back;
    ceres::AngleAxisRotatePoint(x, turned_first.data(), turned.data());
    Vector3<T> const line = t.cross(turned);  // derivative of the error by the right ray
    T const error = q.dot(line);
    T const inverse[3] = {-x[0], -x[1], -x[2]};
    Vector3<T> const other = q.cross(t);
    ceres::AngleAxisRotatePoint(inverse, other.data(), back.data());
    Vector3<T> const line_left = start->rotation.transpose().cast<T>() * back;
    Vector2<T> const by_left = left.ideal_by_pixel.transpose().cast<T>() * line_left.template head<2>();
    Vector2<T> const by_right = right.ideal_by_pixel.transpose().cast<T>() * line.template head<2>();
    residual[0] = weight * error / sqrt(by_left.squaredNorm() + by_right.squaredNorm() + kTiny);
    return true;
  }
};

using CostFunction = ceres::AutoDiffCostFunction<EpipolarCost, 1, kUnknowns>;

Camera with_focal_factor(Camera const& c, double factor) {
  return Camera::perspective(c.width(), c.height(), c.fx() * factor, c.fy() * factor, c.cx(), c.cy());
}

// Folds the increments into the rig.
void apply(Vector7d const& x, PoseStart const& start, StereoRig& rig) {
  Eigen::Vector3d const turn = x.head<3>();
  double const angle = turn.norm();
  Eigen::Matrix3d rotation = start.rotation;
  if (angle > 0) rotation = Eigen::AngleAxisd(angle, turn / angle) * rotation;
  rig.right_from_left.linear() = Eigen::Quaterniond(rotation).normalized().toRotationMatrix();
  rig.right_from_left.translation() = (start.translation + start.tangent * x.segment<2>(3)).normalized();
  double const factor = std::exp(x[kFocal]);
  for (LensCamera* camera : {&rig.left, &rig.right}) {
    if (x[kFocal] != 0) camera->camera = with_focal_factor(camera->camera, factor);
    camera->lens.k1 += x[kK1];
  }
}

PoseStart pose_start(StereoRig const& rig) {
  Eigen::Vector3d const t = rig.right_from_left.translation().normalized();
  return {rig.right_from_left.linear(), t, tangent_plane(t)};
}

std::vector<std::unique_ptr<CostFunction>> make_costs(std::vector<Correspondence> const& matches, StereoRig const& rig,
                                                      PoseStart const& start, EpipolarFitOptions const& options) {
  std::vector<std::unique_ptr<CostFunction>> costs;
  costs.reserve(matches.size());
  for (Correspondence const& match : matches) {
    auto* const cost = new EpipolarCost{Sight(rig.left, match.left), Sight(rig.right, match.right), &start,
                                        1.0 / static_cast<double>(match.sigma_px), options.focal || options.k1};
    costs.push_back(std::make_unique<CostFunction>(cost));
  }
  return costs;
}

std::vector<int> held_unknowns(EpipolarFitOptions const& options) {
  std::vector<int> held;
  if (!options.focal) held.push_back(kFocal);
  if (!options.k1) held.push_back(kK1);
  return held;
}

std::size_t cluster(Camera const& camera, Eigen::Vector2d const& pixel) {
  auto const at = [](double value, int size, int count) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>((value + 0.5) / size * count), 0, count - 1));
  };
  return at(pixel.y(), camera.height(), kClusterRows) * kClusterColumns +
         at(pixel.x(), camera.width(), kClusterColumns);
}

// Information matrix, gradient by cluster and residuals at the optimum (the loss' weights included).
void finish(std::vector<Correspondence> const& matches, std::vector<std::unique_ptr<CostFunction>> const& costs,
            EpipolarFitOptions const& options, PoseStart const& start, EpipolarFit& fit) {
  Vector7d const zero = Vector7d::Zero();
  Matrix7d information = Matrix7d::Zero();
  std::array<Vector7d, kClusterColumns * kClusterRows> gradients;
  gradients.fill(Vector7d::Zero());
  double const scale2 = options.cauchy_sigmas * options.cauchy_sigmas;
  double weighted = 0, weights = 0;
  fit.mean_square = fit.cost = 0;
  for (std::size_t i = 0; i < costs.size(); ++i) {
    double residual = 0;
    Vector7d derivative;
    double const* const at = zero.data();
    double* jacobian = derivative.data();
    costs[i]->Evaluate(&at, &residual, &jacobian);
    double const square = residual * residual;
    double const weight = scale2 > 0 ? 1 / (1 + square / scale2) : 1;
    fit.mean_square += square;
    fit.cost += scale2 > 0 ? scale2 * std::log1p(square / scale2) : square;
    weighted += weight * square;
    weights += weight;
    information += weight * derivative * derivative.transpose();
    gradients[cluster(fit.rig.left.camera, matches[i].left)] += weight * residual * derivative;
  }
  auto const count = static_cast<double>(matches.size());
  for (int const k : held_unknowns(options)) {
    information.row(k).setZero();
    information.col(k).setZero();
    information(k, k) = 1;
  }
  // Scaled, so that unknowns of different size are compared fairly.
  Vector7d const scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  Eigen::SelfAdjointEigenSolver<Matrix7d> const spectrum(
      Matrix7d(scale.asDiagonal() * information * scale.asDiagonal()));
  fit.usable = fit.usable && spectrum.info() == Eigen::Success && spectrum.eigenvalues()[0] > 1e-13;
  Matrix7d const inverse =
      scale.asDiagonal() *
      Matrix7d(spectrum.eigenvectors() * spectrum.eigenvalues().cwiseMax(1e-13).cwiseInverse().asDiagonal() *
               spectrum.eigenvectors().transpose()) *
      scale.asDiagonal();
  Matrix7d scatter = Matrix7d::Zero();
  double used = 0;
  for (Vector7d const& gradient : gradients) {
    scatter += gradient * gradient.transpose();
    used += gradient.isZero() ? 0 : 1;
  }
  double const free = kUnknowns - static_cast<double>(held_unknowns(options).size());
  if (used > free) scatter *= used / (used - free);
  Matrix7d plain = weighted / weights * count / std::max(1.0, count - free) * inverse;
  Matrix7d sandwich = inverse * scatter * inverse;
  for (int const k : held_unknowns(options)) plain(k, k) = sandwich(k, k) = 0;
  auto const deviation = [&](Vector7d const& direction) {
    return std::sqrt(std::max({0.0, direction.dot(plain * direction), direction.dot(sandwich * direction)}));
  };
  fit.mean_square /= count;
  fit.cost /= count;
  fit.focal_std = deviation(Vector7d::Unit(kFocal));
  fit.k1_std = deviation(Vector7d::Unit(kK1));
  auto& deviations = fit.rig.standard_deviations;
  deviations.clear();
  char const* const axes[3] = {"x", "y", "z"};
  for (int k = 0; k < 3; ++k) {
    Vector7d translation = Vector7d::Zero();
    translation.segment<2>(3) = start.tangent.row(k);
    deviations[std::string("rotation.").append(axes[k])] = deviation(Vector7d::Unit(k));
    deviations[std::string("translation.").append(axes[k])] = deviation(translation);
  }
  if (options.focal) {
    deviations["left.fx"] = fit.focal_std * fit.rig.left.camera.fx();
    deviations["left.fy"] = fit.focal_std * fit.rig.left.camera.fy();
    deviations["right.fx"] = fit.focal_std * fit.rig.right.camera.fx();
    deviations["right.fy"] = fit.focal_std * fit.rig.right.camera.fy();
  }
  if (options.k1) deviations["left.k1"] = deviations["right.k1"] = fit.k1_std;
}

}  // namespace

EpipolarResidual epipolar_residual(StereoRig const& rig, Eigen::Vector2d const& left, Eigen::Vector2d const& right) {
  Sight const p(rig.left, left), q(rig.right, right);
  Eigen::Vector3d const t = rig.right_from_left.translation().normalized();
  Eigen::Vector3d const line = t.cross(rig.right_from_left.linear() * p.ideal.homogeneous());
  Eigen::Vector3d const line_left = rig.right_from_left.linear().transpose() * q.ideal.homogeneous().cross(t);
  double const error = q.ideal.homogeneous().dot(line);
  double const by_left = (p.ideal_by_pixel.transpose() * line_left.head<2>()).squaredNorm();
  double const by_right = (q.ideal_by_pixel.transpose() * line.head<2>()).squaredNorm();
  return {error / std::sqrt(by_left + by_right + kTiny), error / std::sqrt(by_right + kTiny)};
}

EpipolarFit fit_epipolar(std::vector<Correspondence> const& matches, StereoRig const& start_rig,
                         EpipolarFitOptions const& options) {
  constexpr int kRounds = 6;
  EpipolarFit fit;
  fit.rig = start_rig;
  fit.rig.unit = "arbitrary";
  fit.rig.right_from_left.translation().normalize();
  fit.usable = true;
  double log_focal = 0;
  std::unique_ptr<ceres::LossFunction> const loss(
      options.cauchy_sigmas > 0 ? new ceres::CauchyLoss(options.cauchy_sigmas) : nullptr);
  for (int round = 0; round < kRounds; ++round) {
    PoseStart const start = pose_start(fit.rig);
    auto const costs = make_costs(matches, fit.rig, start, options);
    ceres::Problem::Options ownership;
    ownership.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    ownership.disable_all_safety_checks = true;
    ceres::Problem problem(ownership);
    Vector7d x = Vector7d::Zero();
    for (auto const& cost : costs) problem.AddResidualBlock(cost.get(), loss.get(), x.data());
    if (auto const held = held_unknowns(options); !held.empty())
      problem.SetManifold(x.data(), new ceres::SubsetManifold(kUnknowns, held));
    ceres::Solver::Options solver;
    solver.num_threads = 1;
    solver.logging_type = ceres::SILENT;
    solver.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
    solver.max_num_iterations = 50;
    solver.function_tolerance = 1e-10;
    ceres::Solver::Summary summary;
    ceres::Solve(solver, &problem, &summary);
    log_focal += x[kFocal];
    fit.usable = x.allFinite() && std::abs(log_focal) < options.largest_step && summary.IsSolutionUsable();
    if (!fit.usable) return fit;
    apply(x, start, fit.rig);
    if (x.head<6>().norm() < 1e-7 && std::abs(x[kK1]) < 1e-6) break;
  }
  PoseStart const start = pose_start(fit.rig);
  finish(matches, make_costs(matches, fit.rig, start, options), options, start, fit);
  return fit;
}

}  // namespace scanview
