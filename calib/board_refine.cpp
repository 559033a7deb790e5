#include "calib/board_refine.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

namespace scanview {
namespace {

using Eigen::Vector2d;

// x, y; directions of both edges (angles); log of the blur; level and its gradient; half contrast and its gradient.
constexpr int kUnknowns = 11;
using Unknowns = Eigen::Matrix<double, kUnknowns, 1>;
using Normal = Eigen::Matrix<double, kUnknowns, kUnknowns>;

constexpr double kWidest = 24;  // pixels: more adds time, and illumination that is not linear

// What the warp says about the corner's surroundings.
struct Surroundings {
  Vector2d corner;
  Eigen::Matrix2d linear, inverse;   // pixels from squares
  Eigen::Matrix<double, 2, 3> bend;  // pixels from (u², uv, v²)
};

Surroundings survey(LocalWarp const& warp) {
  constexpr double h = 0.4;
  Surroundings s;
  s.corner = warp({0, 0});
  Vector2d const right = warp({h, 0}), left = warp({-h, 0}), down = warp({0, h}), up = warp({0, -h});
  s.linear.col(0) = (right - left) / (2 * h);
  s.linear.col(1) = (down - up) / (2 * h);
  s.inverse = s.linear.inverse();
  s.bend.col(0) = (right + left - 2 * s.corner) / (2 * h * h);
  s.bend.col(2) = (down + up - 2 * s.corner) / (2 * h * h);
  s.bend.col(1) = (warp({h, h}) + warp({-h, -h}) - warp({h, -h}) - warp({-h, h})) / (4 * h * h);
  return s;
}

struct Sample {
  Vector2d pixel;
  double value;
};

struct Window {
  std::vector<Sample> samples;
  Surroundings around;
  bool curved;
};

// The pixels around `center`, chosen symmetrically about it.
std::vector<Sample> gather(cv::Mat1f const& picture, Surroundings const& around, Vector2d const& center,
                           CornerFitOptions const& options) {
  std::vector<Sample> samples;
  Vector2d const a = around.linear.col(0), b = around.linear.col(1);
  double const shrink = std::min(1.0, kWidest / (options.reach_squares * std::max(a.norm(), b.norm())));
  double const reach = options.reach_squares * shrink;
  Vector2d const extent = reach * (a.cwiseAbs() + b.cwiseAbs());
  int const x0 = static_cast<int>(std::ceil(center.x() - extent.x())), x1 = static_cast<int>(center.x() + extent.x());
  int const y0 = static_cast<int>(std::ceil(center.y() - extent.y())), y1 = static_cast<int>(center.y() + extent.y());
  for (int y = std::max(0, y0); y <= std::min(picture.rows - 1, y1); ++y)
    for (int x = std::max(0, x0); x <= std::min(picture.cols - 1, x1); ++x) {
      Vector2d const squares = around.inverse * (Vector2d(x, y) - center);
      if (squares.cwiseAbs().maxCoeff() > reach || squares.cwiseAbs().minCoeff() > options.clear_squares) continue;
      samples.push_back({{x, y}, static_cast<double>(picture(y, x))});
    }
  return samples;
}

// The unknowns as the model uses them, computed once for all pixels.
struct Shape {
  Unknowns p;
  double cos1, sin1, cos2, sin2, scale, peak;

  explicit Shape(Unknowns const& unknowns)
      : p(unknowns),
        cos1(std::cos(p[2])),
        sin1(std::sin(p[2])),
        cos2(std::cos(p[3])),
        sin2(std::sin(p[3])),
        scale(1 / (std::numbers::sqrt2 * std::exp(p[4]))),
        peak(2 * std::numbers::inv_sqrtpi * scale) {}
};

// Beyond three deviations an edge is over, to 5 digits.
constexpr double kOver = 3;

// Value and derivatives of the model at a pixel.
double model(Shape const& shape, Window const& window, Vector2d const& pixel, Unknowns* derivative) {
  Unknowns const& p = shape.p;
  Vector2d d = pixel - p.head<2>();
  if (window.curved) {
    Vector2d const s = window.around.inverse * d;
    d -= window.around.bend * Eigen::Vector3d(s.x() * s.x(), s.x() * s.y(), s.y() * s.y());
  }
  double const e1 = shape.cos1 * d.y() - shape.sin1 * d.x(), e2 = shape.cos2 * d.y() - shape.sin2 * d.x();
  double const x1 = e1 * shape.scale, x2 = e2 * shape.scale;
  double const f1 = std::abs(x1) > kOver ? std::copysign(1.0, x1) : std::erf(x1);
  double const f2 = std::abs(x2) > kOver ? std::copysign(1.0, x2) : std::erf(x2);
  double const contrast = p[8] + p[9] * d.x() + p[10] * d.y();
  if (derivative) {
    double const g1 = std::abs(x1) > kOver ? 0 : contrast * f2 * shape.peak * std::exp(-x1 * x1);
    double const g2 = std::abs(x2) > kOver ? 0 : contrast * f1 * shape.peak * std::exp(-x2 * x2);
    auto& j = *derivative;
    // The bend's own derivative by the position is left out: it changes the path, not the minimum's place by more
    // than bend times step.
    j[0] = g1 * shape.sin1 + g2 * shape.sin2 - p[6] - p[9] * f1 * f2;
    j[1] = -g1 * shape.cos1 - g2 * shape.cos2 - p[7] - p[10] * f1 * f2;
    j[2] = g1 * (-shape.sin1 * d.y() - shape.cos1 * d.x());
    j[3] = g2 * (-shape.sin2 * d.y() - shape.cos2 * d.x());
    j[4] = -g1 * e1 - g2 * e2;
    j[5] = 1;
    j[6] = d.x();
    j[7] = d.y();
    j[8] = f1 * f2;
    j[9] = d.x() * f1 * f2;
    j[10] = d.y() * f1 * f2;
  }
  return p[5] + p[6] * d.x() + p[7] * d.y() + contrast * f1 * f2;
}

struct System {
  Normal normal = Normal::Zero();
  Unknowns gradient = Unknowns::Zero();
  double cost = 0;
};

System linearise(Unknowns const& p, Window const& window) {
  System system;
  Shape const shape(p);
  Unknowns j;
  for (Sample const& sample : window.samples) {
    double const error = model(shape, window, sample.pixel, &j) - sample.value;
    for (int column = 0; column < kUnknowns; ++column)
      for (int row = column; row < kUnknowns; ++row) system.normal(row, column) += j[row] * j[column];
    system.gradient += error * j;
    system.cost += error * error;
  }
  system.normal = Normal(system.normal.selfadjointView<Eigen::Lower>());
  return system;
}

double cost_of(Unknowns const& p, Window const& window) {
  double cost = 0;
  Shape const shape(p);
  for (Sample const& sample : window.samples) {
    double const error = model(shape, window, sample.pixel, nullptr) - sample.value;
    cost += error * error;
  }
  return cost;
}

// Level and contrast are linear: solved for at the start.
void start_levels(Unknowns& p, Window const& window) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Vector2d right = Vector2d::Zero();
  Unknowns j;
  p.tail<6>().setZero();
  Shape const shape(p);
  for (Sample const& sample : window.samples) {
    model(shape, window, sample.pixel, &j);
    Vector2d const row(1, j[8]);
    normal += row * row.transpose();
    right += row * sample.value;
  }
  Vector2d const levels = normal.ldlt().solve(right);
  p[5] = levels[0];
  p[8] = levels[1];
}

// Levenberg-Marquardt. Returns whether it settled.
bool minimise(Unknowns& p, Window const& window, System& system) {
  double damping = 1e-3;
  system = linearise(p, window);
  for (int step = 0; step < 60; ++step) {
    Normal damped = system.normal;
    damped.diagonal() *= 1 + damping;
    Unknowns const change = damped.ldlt().solve(-system.gradient);
    if (!change.allFinite()) return false;
    Unknowns const next = p + change;
    if (std::abs(next[4]) < 5 && cost_of(next, window) <= system.cost) {
      p = next;
      system = linearise(p, window);
      damping = std::max(1e-9, damping * 0.1);
      if (change.head<2>().norm() < 1e-4 && change.segment<3>(2).norm() < 1e-2) return true;
    } else {
      damping *= 10;
      if (damping > 1e8) return change.head<2>().norm() < 1e-4;
    }
  }
  return false;
}

}  // namespace

CornerFit fit_corner(cv::Mat1f const& picture, LocalWarp const& warp, CornerFitOptions const& options) {
  CornerFit fit;
  Window window;
  window.around = survey(warp);
  window.curved = options.curved;
  Surroundings const& around = window.around;
  if (!around.corner.allFinite() || !around.linear.allFinite() || !around.bend.allFinite() ||
      !(std::abs(around.linear.determinant()) > 1))
    return fit;
  Vector2d const a = around.linear.col(0), b = around.linear.col(1);
  Unknowns p = Unknowns::Zero();
  p.head<2>() = around.corner;
  p[2] = std::atan2(a.y(), a.x());
  p[3] = std::atan2(b.y(), b.x());
  p[4] = std::log(1.0);
  System system;
  double const shortest = std::min(a.norm(), b.norm());
  // The window follows the corner: chosen about the last estimate, so that it stays symmetric.
  for (int round = 0; round < 3; ++round) {
    Vector2d const center = p.head<2>();
    window.samples = gather(picture, around, center, options);
    if (window.samples.size() < 3 * kUnknowns) return fit;
    if (round == 0) start_levels(p, window);
    if (!minimise(p, window, system)) return fit;
    if ((p.head<2>() - around.corner).norm() > 0.3 * shortest) return fit;
    if ((p.head<2>() - center).norm() < 0.02 && round > 0) break;
  }
  double const freedom = static_cast<double>(window.samples.size()) - kUnknowns;
  Normal const covariance = system.normal.inverse() * (system.cost / freedom);
  fit.pixel = p.head<2>();
  fit.sigma_px = std::sqrt((covariance(0, 0) + covariance(1, 1)) / 2);
  fit.contrast = p[8];
  fit.blur_px = std::exp(p[4]);
  fit.residual = std::sqrt(system.cost / freedom);
  fit.usable = fit.pixel.allFinite() && std::isfinite(fit.sigma_px) && fit.blur_px < 0.5 * shortest;
  return fit;
}

}  // namespace scanview
