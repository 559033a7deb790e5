#include "calib/epipolar_fit.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <string>

#include "base/parallel.h"

namespace scanview {
namespace {

// Unknowns: the rotation's increment (right camera's axes), the translation's in its tangent plane, log of the factor
// on the focal lengths, what is added to k1.
constexpr int kUnknowns = 7, kPoseUnknowns = 5, kFocal = 5, kK1 = 6;
constexpr int kClusterColumns = 16, kClusterRows = 12;
constexpr std::size_t kPiece = 4096;  // matches that one thread works on
constexpr int kBlock = 64;            // of them that are multiplied at once
constexpr double kTiny = 1e-18;       // keeps the Sampson distance of a match at the epipole finite

using Vector7d = Eigen::Matrix<double, kUnknowns, 1>;
using Matrix7d = Eigen::Matrix<double, kUnknowns, kUnknowns>;

// One pixel through one camera.
struct Sight {
  Eigen::Vector2d ideal;   // normalised, straight
  Eigen::Matrix2d spread;  // A Aᵀ where A is its derivative by the pixel: the covariance of a pixel's deviation 1
  Eigen::Vector2d by_focal = Eigen::Vector2d::Zero(), by_k1 = Eigen::Vector2d::Zero();  // derivatives of `ideal`

  Sight() = default;
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
    Eigen::Matrix2d const by_pixel =
        ideal_by_seen * Eigen::Vector2d(1 / camera.camera.fx(), 1 / camera.camera.fy()).asDiagonal();
    spread = by_pixel * by_pixel.transpose();
    by_focal = -ideal_by_seen * seen;  // of its logarithm
    by_k1 = -ideal_by_seen * ideal * (r2 / below);
  }
};

Eigen::Matrix<double, 3, 2> tangent_plane(Eigen::Vector3d const& direction) {
  Eigen::Vector3d const a = direction.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> basis;
  basis << a, direction.cross(a);
  return basis;
}

Eigen::Matrix3d cross_matrix(Eigen::Vector3d const& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

// The pose around which the unknowns are increments.
struct PoseStart {
  Eigen::Matrix3d rotation;
  Eigen::Vector3d translation;
  Eigen::Matrix<double, 3, 2> tangent;
};

// A match in an epipolar geometry: the error q · E p, the epipolar lines, and the error's variance where each pixel
// coordinate has the variance 1.
struct Error {
  double value, variance, right_variance;  // right_variance: by the right pixel alone
  Eigen::Vector2d line, line_left;         // E p and Eᵀ q without their last component
  Eigen::Vector2d by_line, by_line_left;   // half the derivatives of the variance

  Error(Eigen::Matrix3d const& essential, Sight const& left, Sight const& right) {
    Eigen::Vector3d const whole = essential * left.ideal.homogeneous();
    line = whole.head<2>();
    line_left = (essential.transpose() * right.ideal.homogeneous()).head<2>();
    by_line = right.spread * line;
    by_line_left = left.spread * line_left;
    value = right.ideal.dot(line) + whole.z();
    right_variance = line.dot(by_line) + kTiny;
    variance = right_variance + line_left.dot(by_line_left);
  }
};

// Sampson distance and derivatives by the first N unknowns: five (the pose alone) or all seven. The pose acts through
// the essential matrix only, so matches are summed up as derivatives by its nine entries, column by column; those by
// the pose follow from the sums.
template <int N>
class Epipolar {
 public:
  static constexpr int kEntries = 9 + N - kPoseUnknowns;
  // Derivatives by the entries and by the intrinsics that are unknown, last the residual itself, in pixels.
  using Row = Eigen::Matrix<double, kEntries + 1, 1>;

  explicit Epipolar(PoseStart const& start) : essential_(cross_matrix(start.translation) * start.rotation) {
    auto const set = [&](int k, Eigen::Matrix3d const& change) {
      by_unknown_.template block<9, 1>(0, k) = Eigen::Map<Eigen::Matrix<double, 9, 1> const>(change.data());
    };
    Eigen::Matrix3d const across = cross_matrix(start.translation);
    for (int k = 0; k < 3; ++k) set(k, across * cross_matrix(Eigen::Vector3d::Unit(k)) * start.rotation);
    for (int k = 0; k < 2; ++k) set(3 + k, cross_matrix(start.tangent.col(k)) * start.rotation);
    for (int k = kPoseUnknowns; k < N; ++k) by_unknown_(9 + k - kPoseUnknowns, k) = 1;
  }

  Row row(Sight const& left, Sight const& right) const {
    Error const error(essential_, left, right);
    double const per_pixel = 1 / std::sqrt(error.variance), share = error.value / error.variance;
    // d (value / √variance) = (d value - share · d variance / 2) / √variance, where value = q · E p.
    Eigen::Vector2d const q = per_pixel * right.ideal, p = left.ideal - share * error.by_line_left;
    Eigen::Vector2d const other = (per_pixel * share) * error.by_line;
    Row row;
    row.template segment<2>(0) = p.x() * q - left.ideal.x() * other;
    row[2] = per_pixel * p.x();
    row.template segment<2>(3) = p.y() * q - left.ideal.y() * other;
    row[5] = per_pixel * p.y();
    row.template segment<2>(6) = q - other;
    row[8] = per_pixel;
    if constexpr (N == kUnknowns) {
      auto const by_rays = [&](Eigen::Vector2d const& dp, Eigen::Vector2d const& dq) {
        auto const upper = essential_.topLeftCorner<2, 2>();
        double const change = error.line_left.dot(dp) + error.line.dot(dq);
        double const half_variance = error.by_line.dot(upper * dp) + error.by_line_left.dot(upper.transpose() * dq);
        return per_pixel * (change - share * half_variance);
      };
      row[9] = by_rays(left.by_focal, right.by_focal);
      row[10] = by_rays(left.by_k1, right.by_k1);
    }
    row[kEntries] = per_pixel * error.value;
    return row;
  }

  // Derivatives of the entries by the unknowns.
  Eigen::Matrix<double, kEntries, N> const& by_unknown() const { return by_unknown_; }

 private:
  Eigen::Matrix3d essential_;
  Eigen::Matrix<double, kEntries, N> by_unknown_ = Eigen::Matrix<double, kEntries, N>::Zero();
};

struct Sights {
  Sight left, right;
};

// Calls work(first, last) for pieces of [0, count), in parallel; the pieces do not depend on the number of threads.
template <typename Work>
void for_each_piece(Context& context, std::size_t count, Work const& work) {
  for_each_index(context, (count + kPiece - 1) / kPiece,
                 [&](std::size_t i) { work(i * kPiece, std::min(count, (i + 1) * kPiece)); });
}

std::vector<Sights> sights_of(std::vector<Correspondence> const& matches, StereoRig const& rig, Context& context) {
  std::vector<Sights> sights(matches.size());
  for_each_piece(context, matches.size(), [&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i)
      sights[i] = {Sight(rig.left, matches[i].left), Sight(rig.right, matches[i].right)};
  });
  return sights;
}

struct CauchyLoss {
  double scale2;  // 0: squares
  double cost(double square) const { return scale2 > 0 ? scale2 * std::log1p(square / scale2) : square; }
  double weight(double square) const { return scale2 > 0 ? 1 / (1 + square / scale2) : 1; }
};

// Sums cost(square), with a logarithm for many terms together: it is most of the work otherwise.
class CostSum {
 public:
  explicit CostSum(CauchyLoss const& loss) : loss_(loss) {}
  void add(double square) {
    if (!(loss_.scale2 > 0)) {
      sum_ += square;
      return;
    }
    product_ *= 1 + square / loss_.scale2;
    if (product_ > 1e100) fold();
  }
  double value() {
    fold();
    return sum_;
  }

 private:
  void fold() {
    sum_ += loss_.scale2 * std::log(product_);
    product_ = 1;
  }

  CauchyLoss const& loss_;
  double sum_ = 0, product_ = 1;
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

std::vector<int> held_unknowns(EpipolarFitOptions const& options) {
  std::vector<int> held;
  if (!options.focal) held.push_back(kFocal);
  if (!options.k1) held.push_back(kK1);
  return held;
}

// The cost at a rig, and the normal equations there.
struct Normal {
  double cost = 0;
  Matrix7d information = Matrix7d::Zero();
  Vector7d gradient = Vector7d::Zero();
};

template <int N>
Normal normal_of(std::vector<Correspondence> const& matches, std::vector<Sights> const& sights, StereoRig const& rig,
                 CauchyLoss const& loss, Context& context) {
  constexpr int kEntries = Epipolar<N>::kEntries;
  using Products = Eigen::Matrix<double, kEntries + 1, kEntries + 1>;
  Epipolar<N> const epipolar(pose_start(rig));
  std::size_t const pieces = (matches.size() + kPiece - 1) / kPiece;
  std::vector<double> costs(pieces);
  std::vector<Products> products(pieces, Products::Zero());
  for_each_piece(context, matches.size(), [&](std::size_t first, std::size_t last) {
    CostSum cost(loss);
    Eigen::Matrix<double, kEntries + 1, kBlock> rows;
    for (std::size_t block = first; block < last; block += kBlock) {
      auto const count = static_cast<Eigen::Index>(std::min<std::size_t>(kBlock, last - block));
      for (Eigen::Index k = 0; k < count; ++k) {
        std::size_t const i = block + static_cast<std::size_t>(k);
        rows.col(k) = epipolar.row(sights[i].left, sights[i].right);
        double const sigma = static_cast<double>(matches[i].sigma_px), residual = rows(kEntries, k) / sigma;
        double const square = residual * residual;
        cost.add(square);
        rows.col(k) *= std::sqrt(loss.weight(square)) / sigma;
      }
      rows.rightCols(kBlock - count).setZero();
      products[first / kPiece].noalias() += rows * rows.transpose();
    }
    costs[first / kPiece] = cost.value();
  });
  Products const sum = std::accumulate(products.begin(), products.end(), Products(Products::Zero()));
  auto const& by_unknown = epipolar.by_unknown();
  Normal normal;
  normal.cost = std::accumulate(costs.begin(), costs.end(), 0.0);
  normal.information.topLeftCorner<N, N>() =
      by_unknown.transpose() * sum.template topLeftCorner<kEntries, kEntries>() * by_unknown;
  normal.gradient.head<N>() = by_unknown.transpose() * sum.col(kEntries).template head<kEntries>();
  return normal;
}

Normal normal_of(std::vector<Correspondence> const& matches, std::vector<Sights> const& sights, StereoRig const& rig,
                 EpipolarFitOptions const& options, Context& context) {
  CauchyLoss const loss{options.cauchy_sigmas * options.cauchy_sigmas};
  Normal normal = options.focal || options.k1 ? normal_of<kUnknowns>(matches, sights, rig, loss, context)
                                              : normal_of<kPoseUnknowns>(matches, sights, rig, loss, context);
  for (int const k : held_unknowns(options)) {
    normal.information.row(k).setZero();
    normal.information.col(k).setZero();
    normal.information(k, k) = 1;
    normal.gradient[k] = 0;
  }
  return normal;
}

std::size_t cluster(Camera const& camera, Eigen::Vector2d const& pixel) {
  auto const at = [](double value, int size, int count) {
    return static_cast<std::size_t>(std::clamp(static_cast<int>((value + 0.5) / size * count), 0, count - 1));
  };
  return at(pixel.y(), camera.height(), kClusterRows) * kClusterColumns +
         at(pixel.x(), camera.width(), kClusterColumns);
}

// Information matrix, gradient by cluster and residuals at the optimum (the loss' weights included).
template <int N>
void finish(std::vector<Correspondence> const& matches, std::vector<Sights> const& sights,
            EpipolarFitOptions const& options, Matrix7d const& information, EpipolarFit& fit) {
  PoseStart const start = pose_start(fit.rig);
  Epipolar<N> const epipolar(start);
  constexpr int kEntries = Epipolar<N>::kEntries;
  std::array<Eigen::Matrix<double, kEntries, 1>, kClusterColumns * kClusterRows> by_entry;
  by_entry.fill(Eigen::Matrix<double, kEntries, 1>::Zero());
  CauchyLoss const loss{options.cauchy_sigmas * options.cauchy_sigmas};
  double weighted = 0, weights = 0;
  fit.mean_square = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    auto const row = epipolar.row(sights[i].left, sights[i].right);
    double const sigma = static_cast<double>(matches[i].sigma_px), residual = row[kEntries] / sigma;
    double const square = residual * residual, weight = loss.weight(square);
    fit.mean_square += square;
    weighted += weight * square;
    weights += weight;
    by_entry[cluster(fit.rig.left.camera, matches[i].left)] +=
        weight * residual / sigma * row.template head<kEntries>();
  }
  auto const count = static_cast<double>(matches.size());
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
  for (auto const& entries : by_entry) {
    Vector7d gradient = Vector7d::Zero();
    gradient.head<N>() = epipolar.by_unknown().transpose() * entries;
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
  Eigen::Matrix3d const essential =
      cross_matrix(rig.right_from_left.translation().normalized()) * rig.right_from_left.linear();
  Sight const in_left(rig.left, left), in_right(rig.right, right);
  Error const error(essential, in_left, in_right);
  return {error.value / std::sqrt(error.variance),
          error.value / std::sqrt(error.right_variance),
          {in_left.ideal, in_right.ideal}};
}

EpipolarFit fit_epipolar(std::vector<Correspondence> const& matches, StereoRig const& start_rig,
                         EpipolarFitOptions const& options, Context& context) {
  constexpr int kMostSteps = 60;
  EpipolarFit fit;
  fit.rig = start_rig;
  fit.rig.unit = "arbitrary";
  fit.rig.right_from_left.translation().normalize();
  bool const intrinsics = options.focal || options.k1;
  double const start_focal = start_rig.left.camera.fx();
  std::vector<Sights> sights = sights_of(matches, fit.rig, context);
  double damping = 1e-4;
  Normal here = normal_of(matches, sights, fit.rig, options, context);
  fit.usable = std::isfinite(here.cost);
  for (int step = 0; step < kMostSteps && fit.usable; ++step) {
    PoseStart const start = pose_start(fit.rig);
    bool gained = false, ended = false;
    // Levenberg-Marquardt: damped more until the cost falls.
    for (int attempt = 0; attempt < 12 && !gained; ++attempt) {
      Matrix7d damped = here.information;
      damped.diagonal() *= 1 + damping;
      Vector7d const x = -damped.inverse() * here.gradient;
      if (x.allFinite() && x.norm() < 1) {
        StereoRig moved = fit.rig;
        apply(x, start, moved);
        if (intrinsics) sights = sights_of(matches, moved, context);
        Normal const there = normal_of(matches, sights, moved, options, context);
        gained = there.cost <= here.cost;
        if (gained) {
          ended = here.cost - there.cost <= options.least_gain * here.cost;
          fit.rig = std::move(moved);
          here = there;
        }
      }
      damping = gained ? std::max(1e-9, 0.1 * damping) : std::max(1e-6, 10 * damping);
    }
    if (intrinsics && !gained) sights = sights_of(matches, fit.rig, context);
    fit.usable = std::abs(std::log(fit.rig.left.camera.fx() / start_focal)) < options.largest_step;
    if (!gained || ended) break;
  }
  if (!fit.usable) return fit;
  fit.cost = here.cost / static_cast<double>(matches.size());
  if (intrinsics)
    finish<kUnknowns>(matches, sights, options, here.information, fit);
  else
    finish<kPoseUnknowns>(matches, sights, options, here.information, fit);
  return fit;
}

}  // namespace scanview
