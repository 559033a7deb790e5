#include "calib/epipolar_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string>

namespace scanview {
namespace {

// Unknowns: the rotation's increment (right camera's axes), the translation's in its tangent plane, log of the factor
// on the focal lengths, what is added to k1.
constexpr int kUnknowns = 7, kFocal = 5, kK1 = 6;
constexpr int kClusterColumns = 16, kClusterRows = 12;
constexpr double kTiny = 1e-18;  // keeps the Sampson distance of a match at the epipole finite

using Vector7d = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix7d = Eigen::Matrix<double, kUnknowns, kUnknowns>;

// One pixel through one camera.
struct Sight {
  Eigen::Vector2d ideal;           // normalised, straight
  Eigen::Matrix2d ideal_by_pixel;  // derivatives of it
  Eigen::Vector2d ideal_by_focal = Eigen::Vector2d::Zero(), ideal_by_k1 = Eigen::Vector2d::Zero();

  Sight(LensCamera const& camera, Eigen::Vector2d const& pixel) {
    Lens const& lens = camera.lens;
    Eigen::Vector2d const seen = camera.camera.ray_direction(pixel.x(), pixel.y()).head<2>();
    ideal = lens.undistort(seen);
    double const r2 = ideal.squaredNorm(), x = ideal.x(), y = ideal.y();
    double const below = 1 + r2 * (lens.k4 + r2 * (lens.k5 + r2 * lens.k6));
    double const radial = (1 + r2 * (lens.k1 + r2 * (lens.k2 + r2 * lens.k3))) / below;
    double const slope =
        (lens.k1 + r2 * (2 * lens.k2 + r2 * 3 * lens.k3) - radial * (lens.k4 + r2 * (2 * lens.k5 + r2 * 3 * lens.k6))) /
        below;
    Eigen::Matrix2d seen_by_ideal;
    seen_by_ideal(0, 0) = radial + 2 * x * x * slope + 2 * lens.p1 * y + 6 * lens.p2 * x;
    seen_by_ideal(1, 1) = radial + 2 * y * y * slope + 6 * lens.p1 * y + 2 * lens.p2 * x;
    seen_by_ideal(0, 1) = seen_by_ideal(1, 0) = 2 * x * y * slope + 2 * lens.p1 * x + 2 * lens.p2 * y;
    Eigen::Matrix2d const ideal_by_seen = seen_by_ideal.inverse();
    ideal_by_pixel = ideal_by_seen * Eigen::Vector2d(1 / camera.camera.fx(), 1 / camera.camera.fy()).asDiagonal();
    ideal_by_focal = -ideal_by_seen * seen;  // of its logarithm
    ideal_by_k1 = -ideal_by_seen * ideal * (r2 / below);
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

// The Sampson distance in standard deviations, and its derivative by the increments at 0.
struct Term {
  double residual = 0;
  Vector7d derivative = Vector7d::Zero();
};

struct Epipolar {
  PoseStart const& start;
  bool intrinsics;

  double residual(Sight const& left, Sight const& right) const {
    Eigen::Vector3d const p = left.ideal.homogeneous(), q = right.ideal.homogeneous();
    Eigen::Vector3d const line = start.translation.cross(start.rotation * p);
    Eigen::Vector3d const line_left = start.rotation.transpose() * q.cross(start.translation);
    double const square = (left.ideal_by_pixel.transpose() * line_left.head<2>()).squaredNorm() +
                          (right.ideal_by_pixel.transpose() * line.head<2>()).squaredNorm() + kTiny;
    return q.dot(line) / std::sqrt(square);
  }

  Term term(Sight const& left, Sight const& right) const {
    Eigen::Matrix3d const& r = start.rotation;
    Eigen::Vector3d const &t = start.translation, p = left.ideal.homogeneous(), q = right.ideal.homogeneous();
    Eigen::Vector3d const turned = r * p, other = q.cross(t);
    // Derivatives of the error q · (t × R p) by the two rays: the epipolar lines.
    Eigen::Vector3d const line = t.cross(turned), line_left = r.transpose() * other;
    Eigen::Vector2d const by_left = left.ideal_by_pixel.transpose() * line_left.head<2>();
    Eigen::Vector2d const by_right = right.ideal_by_pixel.transpose() * line.head<2>();
    double const error = q.dot(line), square = by_left.squaredNorm() + by_right.squaredNorm() + kTiny;
    double const length = std::sqrt(square);
    Term term;
    term.residual = error / length;
    auto const set = [&](int k, double error_change, Eigen::Vector3d const& line_change,
                         Eigen::Vector3d const& line_left_change) {
      double const square_change = 2 * by_left.dot(left.ideal_by_pixel.transpose() * line_left_change.head<2>()) +
                                   2 * by_right.dot(right.ideal_by_pixel.transpose() * line_change.head<2>());
      term.derivative[k] = (error_change - 0.5 * error * square_change / square) / length;
    };
    for (int k = 0; k < 3; ++k) {
      Eigen::Vector3d const axis = Eigen::Vector3d::Unit(k), moved = axis.cross(turned);
      set(k, other.dot(moved), t.cross(moved), r.transpose() * other.cross(axis));
    }
    for (int k = 0; k < 2; ++k) {
      Eigen::Vector3d const direction = start.tangent.col(k), moved = direction.cross(turned);
      set(3 + k, q.dot(moved), moved, r.transpose() * q.cross(direction));
    }
    if (!intrinsics) return term;
    auto const set_rays = [&](int k, Eigen::Vector2d const& left_change, Eigen::Vector2d const& right_change) {
      Eigen::Vector3d const dp(left_change.x(), left_change.y(), 0), dq(right_change.x(), right_change.y(), 0);
      set(k, line_left.dot(dp) + line.dot(dq), t.cross(r * dp), r.transpose() * dq.cross(t));
    };
    set_rays(kFocal, left.ideal_by_focal, right.ideal_by_focal);
    set_rays(kK1, left.ideal_by_k1, right.ideal_by_k1);
    return term;
  }
};

struct Sights {
  Sight left, right;
};

std::vector<Sights> sights_of(std::vector<Correspondence> const& matches, StereoRig const& rig) {
  std::vector<Sights> sights;
  sights.reserve(matches.size());
  for (Correspondence const& match : matches)
    sights.push_back({Sight(rig.left, match.left), Sight(rig.right, match.right)});
  return sights;
}

struct CauchyLoss {
  double scale2;  // 0: squares
  double cost(double square) const { return scale2 > 0 ? scale2 * std::log1p(square / scale2) : square; }
  double weight(double square) const { return scale2 > 0 ? 1 / (1 + square / scale2) : 1; }
};

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

double total_cost(std::vector<Correspondence> const& matches, std::vector<Sights> const& sights, StereoRig const& rig,
                  CauchyLoss const& loss) {
  PoseStart const start = pose_start(rig);
  Epipolar const epipolar{start, false};
  double sum = 0;
  for (std::size_t i = 0; i < matches.size(); ++i)
    sum += loss.cost(
        std::pow(epipolar.residual(sights[i].left, sights[i].right) / static_cast<double>(matches[i].sigma_px), 2));
  return sum;
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
void finish(std::vector<Correspondence> const& matches, std::vector<Sights> const& sights,
            EpipolarFitOptions const& options, EpipolarFit& fit) {
  PoseStart const start = pose_start(fit.rig);
  Epipolar const epipolar{start, options.focal || options.k1};
  Matrix7d information = Matrix7d::Zero();
  std::array<Vector7d, kClusterColumns * kClusterRows> gradients;
  gradients.fill(Vector7d::Zero());
  CauchyLoss const loss{options.cauchy_sigmas * options.cauchy_sigmas};
  double weighted = 0, weights = 0;
  fit.mean_square = fit.cost = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    Term term = epipolar.term(sights[i].left, sights[i].right);
    term.residual /= static_cast<double>(matches[i].sigma_px);
    term.derivative /= static_cast<double>(matches[i].sigma_px);
    double const square = term.residual * term.residual;
    double const weight = loss.weight(square);
    fit.mean_square += square;
    fit.cost += loss.cost(square);
    weighted += weight * square;
    weights += weight;
    information += weight * term.derivative * term.derivative.transpose();
    gradients[cluster(fit.rig.left.camera, matches[i].left)] += weight * term.residual * term.derivative;
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
  constexpr int kMostSteps = 60;
  constexpr double kConverged = 1e-12;  // relative gain of the cost
  EpipolarFit fit;
  fit.rig = start_rig;
  fit.rig.unit = "arbitrary";
  fit.rig.right_from_left.translation().normalize();
  CauchyLoss const loss{options.cauchy_sigmas * options.cauchy_sigmas};
  bool const intrinsics = options.focal || options.k1;
  double const start_focal = start_rig.left.camera.fx();
  auto const held = held_unknowns(options);
  std::vector<Sights> sights = sights_of(matches, fit.rig);
  double damping = 1e-4;
  double cost = total_cost(matches, sights, fit.rig, loss);
  fit.usable = std::isfinite(cost);
  for (int step = 0; step < kMostSteps && fit.usable; ++step) {
    PoseStart const start = pose_start(fit.rig);
    Epipolar const epipolar{start, intrinsics};
    Matrix7d information = Matrix7d::Zero();
    Vector7d gradient = Vector7d::Zero();
    for (std::size_t i = 0; i < matches.size(); ++i) {
      Term const term = epipolar.term(sights[i].left, sights[i].right);
      double const precision = 1 / std::pow(static_cast<double>(matches[i].sigma_px), 2);
      double const weight = precision * loss.weight(precision * term.residual * term.residual);
      information += weight * term.derivative * term.derivative.transpose();
      gradient += weight * term.residual * term.derivative;
    }
    for (int const k : held) {
      information.row(k).setZero();
      information.col(k).setZero();
      information(k, k) = 1;
      gradient[k] = 0;
    }
    bool gained = false, ended = false;
    // Levenberg-Marquardt: damped more until the cost falls.
    for (int attempt = 0; attempt < 12 && !gained && !ended; ++attempt) {
      Matrix7d damped = information;
      damped.diagonal() *= 1 + damping;
      Vector7d const x = -damped.inverse() * gradient;
      StereoRig moved = fit.rig;
      if (x.allFinite() && x.norm() < 1) apply(x, start, moved);
      double const moved_cost = [&] {
        if (!x.allFinite() || x.norm() >= 1) return std::numeric_limits<double>::infinity();
        return total_cost(matches, intrinsics ? sights_of(matches, moved) : sights, moved, loss);
      }();
      if (moved_cost <= cost) {
        gained = true;
        ended = cost - moved_cost <= kConverged * cost;
        fit.rig = moved;
        cost = moved_cost;
        damping = std::max(1e-9, 0.1 * damping);
        if (intrinsics) sights = sights_of(matches, fit.rig);
      } else {
        damping = std::max(1e-6, 10 * damping);
      }
    }
    fit.usable = std::abs(std::log(fit.rig.left.camera.fx() / start_focal)) < options.largest_step;
    if (!gained || ended) break;
  }
  if (!fit.usable) return fit;
  finish(matches, sights, options, fit);
  return fit;
}

}  // namespace scanview
