#include "register/joint_refinement.h"

#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numeric>

namespace scanview {
namespace {

constexpr double kFreeEigenvalue = 1e-8;  // of the largest
constexpr double kFreeDeviation = 0.05;   // of the radius
constexpr double kFalse = 10;             // mean square of a false pair: of 10^5 right ones chance gives one 6
constexpr double kInseparable = 0.8;      // share of the worst's that another pair has if either may be wrong
constexpr double kControlled = 0.02;      // share of a pair's error along a motion that the others must show
constexpr double kHeldDeviation = 1e-6;   // of the radius: free motions while the rest is solved

using Matrix6x12 = Eigen::Matrix<double, 6, 12>;

Eigen::Matrix3d cross_matrix(Eigen::Vector3d const& v) {
  Eigen::Matrix3d m;
  m << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return m;
}

// Derivative of a pair's motion by the increments of a and of b.
Matrix6x12 pair_derivative(JointProblem const& problem, PairMeasurement const& pair) {
  Eigen::Isometry3d const b_from_a = problem.object_from_camera[pair.b].inverse() * problem.object_from_camera[pair.a];
  Eigen::Matrix3d const r = b_from_a.linear();
  Eigen::Vector3d const arm_a = pair.center - b_from_a * problem.centroids[pair.a];
  Eigen::Vector3d const arm_b = pair.center - problem.centroids[pair.b];
  Matrix6x12 d = Matrix6x12::Zero();
  d.block<3, 3>(0, 0) = r;
  d.block<3, 3>(3, 0) = -cross_matrix(arm_a) * r / problem.radius;
  d.block<3, 3>(3, 3) = r;
  d.block<3, 3>(0, 6) = -Eigen::Matrix3d::Identity();
  d.block<3, 3>(3, 6) = cross_matrix(arm_b) / problem.radius;
  d.block<3, 3>(3, 9) = -Eigen::Matrix3d::Identity();
  return d;
}

Eigen::MatrixXd joint_information(JointProblem const& problem) {
  auto const size = static_cast<Eigen::Index>(6 * problem.object_from_camera.size());
  Eigen::MatrixXd information = Eigen::MatrixXd::Zero(size, size);
  for (PairMeasurement const& pair : problem.pairs) {
    Matrix6x12 const d = pair_derivative(problem, pair);
    Eigen::Matrix<double, 12, 12> const h = d.transpose() * pair.information * d;
    auto const a = static_cast<Eigen::Index>(6 * pair.a), b = static_cast<Eigen::Index>(6 * pair.b);
    information.block<6, 6>(a, a) += h.block<6, 6>(0, 0);
    information.block<6, 6>(a, b) += h.block<6, 6>(0, 6);
    information.block<6, 6>(b, a) += h.block<6, 6>(6, 0);
    information.block<6, 6>(b, b) += h.block<6, 6>(6, 6);
  }
  return information;
}

// |factor t + offset|^2 = t' information t + 2 gradient' t + constant.
struct SquareRoot {
  Matrix6d factor = Matrix6d::Zero();
  Vector6d offset = Vector6d::Zero();
};
SquareRoot square_root(Matrix6d const& information, Vector6d const& gradient) {
  Eigen::SelfAdjointEigenSolver<Matrix6d> const spectrum(information);
  double const least = 1e-12 * spectrum.eigenvalues()[5];
  SquareRoot root;
  for (int k = 0; k < 6; ++k) {
    double const value = spectrum.eigenvalues()[k];
    if (!(value > least)) continue;
    root.factor.row(k) = std::sqrt(value) * spectrum.eigenvectors().col(k).transpose();
    root.offset[k] = spectrum.eigenvectors().col(k).dot(gradient) / std::sqrt(value);
  }
  return root;
}

// A rotation (by axis times angle) about a point, then a translation.
template <typename T>
struct Increment {
  Eigen::Matrix<T, 3, 3> rotation;
  Eigen::Matrix<T, 3, 1> translation;
  Increment(T const* twist, Eigen::Vector3d const& center, double radius) {
    T const axis[3] = {twist[0] / radius, twist[1] / radius, twist[2] / radius};
    ceres::AngleAxisToRotationMatrix(axis, rotation.data());
    Eigen::Matrix<T, 3, 1> const c = center.cast<T>();
    translation = c + Eigen::Matrix<T, 3, 1>(twist[3], twist[4], twist[5]) - rotation * c;
  }
};

struct PairCost {
  Eigen::Isometry3d b_from_a, measured;
  Eigen::Vector3d centroid_a, centroid_b, center;
  double radius;
  SquareRoot root;

  template <typename T>
  bool operator()(T const* twist_a, T const* twist_b, T* residual) const {
    Increment<T> const a(twist_a, centroid_a, radius), b(twist_b, centroid_b, radius);
    // motion = b^-1 * b_from_a * a * measured^-1
    Eigen::Isometry3d const a_from_b = measured.inverse();
    Eigen::Matrix<T, 3, 3> const right = a.rotation * a_from_b.linear().cast<T>();
    Eigen::Matrix<T, 3, 1> const right_t = a.rotation * a_from_b.translation().cast<T>() + a.translation;
    Eigen::Matrix<T, 3, 3> const middle = b_from_a.linear().cast<T>() * right;
    Eigen::Matrix<T, 3, 1> const middle_t =
        b_from_a.linear().cast<T>() * right_t + b_from_a.translation().cast<T>() - b.translation;
    Eigen::Matrix<T, 3, 3> const rotation = b.rotation.transpose() * middle;
    Eigen::Matrix<T, 3, 1> const translation = b.rotation.transpose() * middle_t;
    Eigen::Matrix<T, 6, 1> twist;
    T axis[3];
    ceres::RotationMatrixToAngleAxis(rotation.data(), axis);
    Eigen::Matrix<T, 3, 1> const c = center.cast<T>();
    twist << axis[0] * radius, axis[1] * radius, axis[2] * radius, rotation * c + translation - c;
    Eigen::Map<Eigen::Matrix<T, 6, 1>> result(residual);
    result = root.factor.cast<T>() * twist + root.offset.cast<T>();
    return true;
  }
};

// A pose's distance from what it was believed to be.
struct BeliefCost {
  Eigen::Isometry3d believed_from_camera;  // inverse(believed) * pose, in camera coordinates
  Eigen::Vector3d centroid;
  double radius;
  Matrix6d factor;

  template <typename T>
  bool operator()(T const* twist, T* residual) const {
    Increment<T> const increment(twist, centroid, radius);
    Eigen::Matrix<T, 3, 3> const rotation = believed_from_camera.linear().cast<T>() * increment.rotation;
    Eigen::Matrix<T, 6, 1> deviation;
    T axis[3];
    ceres::RotationMatrixToAngleAxis(rotation.data(), axis);
    deviation << axis[0] * radius, axis[1] * radius, axis[2] * radius,
        believed_from_camera.linear().cast<T>() * (increment.rotation * centroid.cast<T>() + increment.translation) +
            believed_from_camera.translation().cast<T>() - centroid.cast<T>();
    Eigen::Map<Eigen::Matrix<T, 6, 1>> result(residual);
    result = factor.cast<T>() * deviation;
    return true;
  }
};

// Belief shall act where the data says little and not pull at all where it says more: along every principal motion of a
// view's covariance its inverse variance counts by the square of the share that an ordinary prior would have had. (As
// an ordinary prior, a belief of a tenth of the data's weight would still pull by a tenth of an error in the start.)
Matrix6d belief_factor(JointSpectrum const& spectrum, std::size_t view, double std) {
  auto const at = static_cast<Eigen::Index>(6 * view);
  Eigen::MatrixXd const open = spectrum.free_motions.middleRows(at, 6);
  double const variance = std * std;
  Matrix6d const covariance = spectrum.covariance.block<6, 6>(at, at) + 1e6 * variance * open * open.transpose();
  Eigen::SelfAdjointEigenSolver<Matrix6d> const motions(covariance);
  Matrix6d factor = Matrix6d::Zero();
  for (int k = 0; k < 6; ++k) {
    double const of_data = std::max(0.0, motions.eigenvalues()[k]);
    factor.row(k) = of_data / (of_data + variance) / std * motions.eigenvectors().col(k).transpose();
  }
  return factor;
}

// Keeps the free motions at rest while the rest is solved. Taken out afterwards only, they would have run far (little
// noise moves what nothing holds) and the rest with them, since turns are not linear.
class FreeMotionCost : public ceres::CostFunction {
 public:
  FreeMotionCost(Eigen::MatrixXd const& free_motions, double std) : rows_(free_motions.transpose() / std) {
    set_num_residuals(static_cast<int>(rows_.rows()));
    for (Eigen::Index i = 0; i < rows_.cols() / 6; ++i) mutable_parameter_block_sizes()->push_back(6);
  }
  bool Evaluate(double const* const* twists, double* residuals, double** jacobians) const override {
    Eigen::Map<Eigen::VectorXd> sum(residuals, rows_.rows());
    sum.setZero();
    for (Eigen::Index i = 0; i < rows_.cols() / 6; ++i) {
      auto const own = rows_.middleCols<6>(6 * i);
      sum += own * Eigen::Map<Vector6d const>(twists[i]);
      if (jacobians != nullptr && jacobians[i] != nullptr)
        Eigen::Map<Eigen::Matrix<double, Eigen::Dynamic, 6, Eigen::RowMajor>>(jacobians[i], rows_.rows(), 6) = own;
    }
    return true;
  }

 private:
  Eigen::MatrixXd rows_;
};

// What a pair is off the balance, in the deviations that its own error leaves there, squared, by the number of motions
// that the other pairs control; 0 where they control none.
double mean_square_against_others(JointProblem const& problem, JointSpectrum const& spectrum,
                                  PairMeasurement const& pair) {
  SquareRoot const root = square_root(pair.information, pair.gradient);
  Eigen::Isometry3d const b_from_a = problem.object_from_camera[pair.b].inverse() * problem.object_from_camera[pair.a];
  Vector6d const off =
      root.factor * twist_of(b_from_a * pair.b_from_a.inverse(), pair.center, problem.radius) + root.offset;
  auto const a = static_cast<Eigen::Index>(6 * pair.a), b = static_cast<Eigen::Index>(6 * pair.b);
  Eigen::Matrix<double, 12, 12> covariance;
  covariance << spectrum.covariance.block<6, 6>(a, a), spectrum.covariance.block<6, 6>(a, b),
      spectrum.covariance.block<6, 6>(b, a), spectrum.covariance.block<6, 6>(b, b);
  Matrix6x12 const d = root.factor * pair_derivative(problem, pair);
  Eigen::SelfAdjointEigenSolver<Matrix6d> const left(Matrix6d::Identity() - d * covariance * d.transpose());
  double sum = 0;
  int motions = 0;
  for (int k = 0; k < 6; ++k) {
    bool const measured = (root.factor.transpose() * left.eigenvectors().col(k)).squaredNorm() > 0;
    if (!measured || left.eigenvalues()[k] < kControlled) continue;
    sum += std::pow(left.eigenvectors().col(k).dot(off), 2) / left.eigenvalues()[k];
    ++motions;
  }
  return motions > 0 ? sum / motions : 0;
}

std::string direction_text(Eigen::Vector3d direction) {
  Eigen::Index largest = 0;
  direction.cwiseAbs().maxCoeff(&largest);
  if (direction[largest] < 0) direction = -direction;
  return fmt::format("({:.2f}, {:.2f}, {:.2f})", direction.x() + 0.0, direction.y() + 0.0, direction.z() + 0.0);
}

}  // namespace

std::vector<std::size_t> place_along(std::vector<PairMeasurement> const& pairs,
                                     std::vector<Eigen::Isometry3d>& object_from_camera) {
  auto& poses = object_from_camera;
  std::vector<std::size_t> part(poses.size()), used;
  std::iota(part.begin(), part.end(), std::size_t{0});
  for (std::size_t k = 0; k < pairs.size(); ++k) {
    auto const& [a, b] = std::pair(pairs[k].a, pairs[k].b);
    std::size_t const keep = std::min(part[a], part[b]), go = std::max(part[a], part[b]);
    if (keep == go) continue;
    Eigen::Isometry3d const move = part[a] == keep ? poses[a] * pairs[k].b_from_a.inverse() * poses[b].inverse()
                                                   : poses[b] * pairs[k].b_from_a * poses[a].inverse();
    for (std::size_t i = 0; i < poses.size(); ++i)
      if (part[i] == go) {
        poses[i] = move * poses[i];
        part[i] = keep;
      }
    used.push_back(k);
  }
  return used;
}

JointSpectrum joint_spectrum(JointProblem const& problem) {
  std::vector<Eigen::Index> variables;
  for (std::size_t i = 0; i < problem.fixed.size(); ++i)
    for (int k = 0; k < 6 && !problem.fixed[i]; ++k) variables.push_back(static_cast<Eigen::Index>(6 * i) + k);
  auto const full = static_cast<Eigen::Index>(6 * problem.fixed.size());
  auto const count = static_cast<Eigen::Index>(variables.size());
  JointSpectrum result{Eigen::MatrixXd::Zero(full, 0), Eigen::MatrixXd::Zero(full, full)};
  if (count == 0) return result;
  Eigen::MatrixXd const all = joint_information(problem);
  Eigen::MatrixXd information(count, count);
  for (Eigen::Index r = 0; r < count; ++r)
    for (Eigen::Index c = 0; c < count; ++c) information(r, c) = all(variables[r], variables[c]);
  auto const put_covariance = [&](Eigen::MatrixXd const& covariance) {
    for (Eigen::Index r = 0; r < count; ++r)
      for (Eigen::Index c = 0; c < count; ++c) result.covariance(variables[r], variables[c]) = covariance(r, c);
  };
  // Where no eigenvalue can lie below the threshold, which a Cholesky decomposition tells, none need be known: of 200
  // views that is several times faster.
  double const bound = information.cwiseAbs().rowwise().sum().maxCoeff();
  double const surely_held = std::max(kFreeEigenvalue * bound, 1.0 / std::pow(kFreeDeviation * problem.radius, 2));
  Eigen::MatrixXd const identity = Eigen::MatrixXd::Identity(count, count);
  if (Eigen::LLT<Eigen::MatrixXd>(information - surely_held * identity).info() == Eigen::Success) {
    put_covariance(information.llt().solve(identity));
    return result;
  }
  Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> const spectrum(information);
  double const least =
      std::max(kFreeEigenvalue * spectrum.eigenvalues()[count - 1], 1.0 / std::pow(kFreeDeviation * problem.radius, 2));
  Eigen::Index free = 0;
  while (free < count && !(spectrum.eigenvalues()[free] > least)) ++free;
  result.free_motions = Eigen::MatrixXd::Zero(full, free);
  for (Eigen::Index r = 0; r < count; ++r)
    result.free_motions.row(variables[r]) = spectrum.eigenvectors().row(r).head(free);
  Eigen::MatrixXd const rest = spectrum.eigenvectors().rightCols(count - free);
  Eigen::MatrixXd const covariance =
      rest * spectrum.eigenvalues().tail(count - free).cwiseInverse().asDiagonal() * rest.transpose();
  put_covariance(covariance);
  return result;
}

std::vector<std::string> describe_free_motions(JointProblem const& problem, JointSpectrum const& spectrum,
                                               std::vector<std::string> const& names) {
  Eigen::MatrixXd const& basis = spectrum.free_motions;
  std::vector<std::string> words;
  if (basis.cols() == 0) return words;
  // Turn the basis so that pure translations stand apart from turns: singular vectors of the rotation rows.
  auto const n = static_cast<Eigen::Index>(problem.fixed.size());
  Eigen::MatrixXd rotations(3 * n, basis.cols());
  for (Eigen::Index i = 0; i < n; ++i) rotations.middleRows(3 * i, 3) = basis.middleRows(6 * i, 3);
  Eigen::JacobiSVD<Eigen::MatrixXd> const svd(rotations, Eigen::ComputeThinU | Eigen::ComputeFullV);
  Eigen::MatrixXd const turned = basis * svd.matrixV();
  for (Eigen::Index k = 0; k < turned.cols(); ++k) {
    bool const slides = k >= svd.singularValues().size() || svd.singularValues()[k] < 0.05;
    double largest = 0;
    for (Eigen::Index i = 0; i < n; ++i) largest = std::max(largest, turned.col(k).segment(6 * i, 6).norm());
    std::string who;
    Eigen::Vector3d direction = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < n; ++i) {
      auto const part = turned.col(k).segment(6 * i, 6);
      if (part.norm() < 0.5 * largest) continue;
      auto const view = static_cast<std::size_t>(i);
      who += (who.empty() ? "" : ", ") + names[view];
      if (direction.isZero())
        direction = problem.object_from_camera[view].linear() *
                    (slides ? Eigen::Vector3d(part.tail<3>()) : Eigen::Vector3d(part.head<3>()));
    }
    if (direction.norm() > 0) direction.normalize();
    words.push_back(fmt::format("{} may {} {}", who, slides ? "slide along" : "turn about", direction_text(direction)));
  }
  return words;
}

JointStep solve_joint(JointProblem const& problem, JointSpectrum const& spectrum, PairLoss loss) {
  std::size_t const n = problem.object_from_camera.size();
  std::vector<Vector6d> twists(n, Vector6d::Zero());
  ceres::Problem ceres_problem;
  for (PairMeasurement const& pair : problem.pairs) {
    if (pair.information.trace() <= 0) continue;
    auto* const cost = new PairCost{problem.object_from_camera[pair.b].inverse() * problem.object_from_camera[pair.a],
                                    pair.b_from_a,
                                    problem.centroids[pair.a],
                                    problem.centroids[pair.b],
                                    pair.center,
                                    problem.radius,
                                    square_root(pair.information, pair.gradient)};
    ceres_problem.AddResidualBlock(new ceres::AutoDiffCostFunction<PairCost, 6, 6, 6>(cost),
                                   loss == PairLoss::cauchy ? new ceres::CauchyLoss(1.0) : nullptr,
                                   twists[pair.a].data(), twists[pair.b].data());
  }
  for (std::size_t i = 0; i < n; ++i)
    if (problem.fixed[i] && ceres_problem.HasParameterBlock(twists[i].data()))
      ceres_problem.SetParameterBlockConstant(twists[i].data());
  for (std::size_t i = 0; i < problem.believed.size() && problem.belief_std > 0; ++i) {
    if (problem.fixed[i] || !ceres_problem.HasParameterBlock(twists[i].data())) continue;
    auto* const cost =
        new BeliefCost{problem.believed[i].inverse() * problem.object_from_camera[i], problem.centroids[i],
                       problem.radius, belief_factor(spectrum, i, problem.belief_std)};
    ceres_problem.AddResidualBlock(new ceres::AutoDiffCostFunction<BeliefCost, 6, 6>(cost), nullptr, twists[i].data());
  }
  if (spectrum.free_motions.cols() > 0 && ceres_problem.NumResidualBlocks() > 0) {
    std::vector<double*> blocks;
    for (std::size_t i = 0; i < n; ++i) {
      blocks.push_back(twists[i].data());
      if (ceres_problem.HasParameterBlock(twists[i].data())) continue;
      ceres_problem.AddParameterBlock(twists[i].data(), 6);
      ceres_problem.SetParameterBlockConstant(twists[i].data());
    }
    ceres_problem.AddResidualBlock(new FreeMotionCost(spectrum.free_motions, kHeldDeviation * problem.radius), nullptr,
                                   blocks);
  }
  JointStep step{problem.object_from_camera, std::vector<Vector6d>(n, Vector6d::Zero()), 0, 0};
  if (ceres_problem.NumResidualBlocks() > 0) {
    ceres::Solver::Options options;
    options.num_threads = 1;
    options.logging_type = ceres::SILENT;
    options.linear_solver_type = n <= 60 ? ceres::DENSE_NORMAL_CHOLESKY : ceres::SPARSE_NORMAL_CHOLESKY;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.max_num_iterations = loss == PairLoss::cauchy ? 100 : 10;
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_problem, &summary);
    step.gain = 2 * (summary.initial_cost - summary.final_cost);
  }
  Eigen::VectorXd all(static_cast<Eigen::Index>(6 * n));
  for (std::size_t i = 0; i < n; ++i) all.segment<6>(static_cast<Eigen::Index>(6 * i)) = twists[i];
  if (spectrum.free_motions.cols() > 0)
    all -= (spectrum.free_motions * (spectrum.free_motions.transpose() * all)).eval();
  for (std::size_t i = 0; i < n; ++i) {
    Vector6d const twist = all.segment<6>(static_cast<Eigen::Index>(6 * i));
    if (!twist.allFinite() || problem.fixed[i]) continue;
    step.twists[i] = twist;
    step.largest = std::max(step.largest, twist.norm());
    step.object_from_camera[i] = problem.object_from_camera[i] * motion(twist, problem.centroids[i], problem.radius);
  }
  return step;
}

std::vector<std::size_t> find_false_pairs(JointProblem const& problem) {
  JointProblem rest = problem;
  rest.believed.clear();
  std::vector<std::size_t> found;
  for (;;) {
    rest.object_from_camera = solve_joint(rest, joint_spectrum(rest), PairLoss::quadratic).object_from_camera;
    JointSpectrum const spectrum = joint_spectrum(rest);
    std::vector<double> squares(rest.pairs.size(), 0), counted;
    for (std::size_t k = 0; k < rest.pairs.size(); ++k) {
      if (rest.pairs[k].information.trace() <= 0) continue;
      squares[k] = mean_square_against_others(rest, spectrum, rest.pairs[k]);
      if (squares[k] > 0) counted.push_back(squares[k]);
    }
    if (counted.size() < 3) break;
    std::sort(counted.begin(), counted.end(), std::greater<>());
    double const usual = std::max(1.0, counted[counted.size() / 2]);
    if (counted[0] < kFalse * usual || counted[1] > kInseparable * counted[0]) break;
    auto const worst = static_cast<std::size_t>(std::max_element(squares.begin(), squares.end()) - squares.begin());
    rest.pairs[worst].information.setZero();
    found.push_back(worst);
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace scanview
