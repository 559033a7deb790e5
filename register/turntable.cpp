#include "register/turntable.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "base/parallel.h"
#include "register/pair_form.h"

namespace scanview {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr int kParameters = 5;  // axis turned about two normals, point moved along them, step
using Vector5d = Eigen::Matrix<double, kParameters, 1>;
using Matrix5d = Eigen::Matrix<double, kParameters, kParameters>;

Eigen::Isometry3d turn_about(Eigen::Vector3d const& axis, Eigen::Vector3d const& point, double angle) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = Eigen::AngleAxisd(angle, axis).toRotationMatrix();
  result.translation() = point - result.linear() * point;
  return result;
}

Turntable moved(Turntable const& table, Vector5d const& change, double radius) {
  Eigen::Vector3d const u = table.axis.unitOrthogonal(), v = table.axis.cross(u);
  Turntable result = table;
  result.axis = (table.axis + (change[0] * u + change[1] * v) / radius).normalized();
  result.point += change[2] * u + change[3] * v;
  result.step_deg += change[4] / radius / kDegree;
  return result;
}

struct NeighbourPair {
  std::size_t a, b;
};

// Sum of the pairs' forms, in the turntable's parameters.
struct TableForm {
  Matrix5d information = Matrix5d::Zero();
  Vector5d gradient = Vector5d::Zero();
  double cost = 0;
};

TableForm evaluate(std::vector<SurfacePyramid> const& views, std::size_t level, std::vector<NeighbourPair> const& pairs,
                   Turntable const& table, MatchOptions const& options) {
  TableForm form;
  double const epsilon = 1e-4 * options.radius;
  auto const relative = [&](Turntable const& t, NeighbourPair const& pair) {
    double const steps = static_cast<double>(pair.b) - static_cast<double>(pair.a);
    return turn_about(t.axis, t.point, steps * t.step_deg * kDegree);
  };
  for (NeighbourPair const& pair : pairs) {
    auto const surface = [&](std::size_t i) -> ViewSurface const& {
      return views[i].levels[std::min(level, views[i].levels.size() - 1)];
    };
    Eigen::Isometry3d const b_from_a = relative(table, pair);
    PairForm const match =
        match_pair(surface(pair.a), surface(pair.b), b_from_a, views[pair.a].centroid, views[pair.b].centroid, options);
    form.cost += match.cost;
    Eigen::Matrix<double, 6, kParameters> derivative;
    for (int k = 0; k < kParameters; ++k) {
      Vector5d change = Vector5d::Zero();
      change[k] = epsilon;
      derivative.col(k) = twist_of(relative(moved(table, change, options.radius), pair) * b_from_a.inverse(),
                                   match.center, options.radius) /
                          epsilon;
    }
    form.information += derivative.transpose() * match.information * derivative;
    form.gradient += derivative.transpose() * match.gradient;
  }
  form.cost /= static_cast<double>(std::max<std::size_t>(1, pairs.size()));
  return form;
}

struct Free {
  bool axis = true, step = false;
};

Turntable improve(std::vector<SurfacePyramid> const& views, std::size_t level, std::vector<NeighbourPair> const& pairs,
                  Turntable table, MatchOptions options, double first_gate, double last_gate, int iterations,
                  Free const& free) {
  for (int i = 0; i < iterations; ++i) {
    options.gate = first_gate * std::pow(last_gate / first_gate, static_cast<double>(i) / (iterations - 1));
    TableForm form = evaluate(views, level, pairs, table, options);
    for (int k = 0; k < kParameters; ++k) {
      bool const is_free = k < 2 ? free.axis : k < 4 || free.step;
      if (is_free) continue;
      form.information.row(k).setZero();
      form.information.col(k).setZero();
      form.gradient[k] = 0;
    }
    double const damping = 1e-3 * form.information.trace() + 1e-12;
    form.information.diagonal().array() += damping;
    Vector5d step = -form.information.ldlt().solve(form.gradient);
    if (!step.allFinite()) break;
    double const longest = 0.3 * options.radius;
    if (step.norm() > longest) step *= longest / step.norm();
    table = moved(table, step, options.radius);
  }
  options.gate = last_gate;
  table.cost = evaluate(views, level, pairs, table, options).cost;
  return table;
}

}  // namespace

std::vector<Eigen::Isometry3d> Turntable::object_from_camera(std::size_t views) const {
  std::vector<Eigen::Isometry3d> poses;
  for (std::size_t i = 0; i < views; ++i)
    poses.push_back(turn_about(axis, point, -static_cast<double>(i) * step_deg * kDegree));
  return poses;
}

Turntable fit_turntable(std::vector<SurfacePyramid> const& views, TurntableOptions const& options, Context& context) {
  std::size_t const n = views.size();
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  double with_depths = 0;
  for (SurfacePyramid const& view : views)
    if (view.depths > 0) {
      center += view.centroid;
      ++with_depths;
    }
  if (with_depths > 0) center /= with_depths;

  std::vector<double> steps;
  bool const axis_given = options.axis.norm() > 0;
  if (options.step_deg != 0) {
    steps.push_back(options.step_deg);
    if (!axis_given) steps.push_back(-options.step_deg);
  } else {
    for (std::size_t turn : {n, n - 1})
      for (double sign : {1.0, -1.0})
        if (turn > 1) steps.push_back(sign * 360.0 / static_cast<double>(turn));
  }
  std::vector<Eigen::Vector3d> axes;
  if (axis_given)
    axes.push_back(options.axis.normalized());
  else
    for (double tilt : {0.0, 20.0, 40.0, 60.0, -20.0})
      axes.push_back({0, -std::cos(tilt * kDegree), -std::sin(tilt * kDegree)});

  std::vector<Turntable> tables;
  for (double step : steps)
    for (Eigen::Vector3d const& axis : axes)
      for (double behind : {0.0, 0.4, 0.8}) {
        // What is seen is the near half: the axis lies behind it, along the axis' normal nearest to the line of sight.
        Eigen::Vector3d const away = (Eigen::Vector3d::UnitZ() - axis * axis.z()).normalized();
        tables.push_back({axis, center + behind * options.radius * away, step, 1});
      }
  if (n < 2) return tables.empty() ? Turntable{} : tables.front();

  std::vector<NeighbourPair> pairs;
  for (std::size_t i = 0; i + 1 < n; ++i) pairs.push_back({i, i + 1});
  bool const closes = options.step_deg == 0 || std::abs(std::abs(options.step_deg) * static_cast<double>(n) - 360) <
                                                   1.5 * std::abs(options.step_deg);
  if (n > 2 && closes) pairs.push_back({n - 1, 0});

  MatchOptions match;
  match.radius = options.radius;
  match.min_normal_cos = 0.5;
  match.use = MatchOptions::Use::shape;
  match.max_samples = 300;
  std::size_t coarsest = 0;
  for (SurfacePyramid const& view : views) coarsest = std::max(coarsest, view.levels.size() - 1);
  for_each_index(context, tables.size(), [&](std::size_t i) {
    tables[i] = improve(views, coarsest, pairs, tables[i], match, 0.4 * options.radius, 0.12 * options.radius, 12,
                        {!axis_given, false});
  });
  auto const better = [](Turntable const& l, Turntable const& r) { return l.cost < r.cost; };
  std::stable_sort(tables.begin(), tables.end(), better);

  tables.resize(std::min<std::size_t>(tables.size(), 8));
  match.use = MatchOptions::Use::shape_and_tone;
  match.max_samples = 1200;
  for_each_index(context, tables.size(), [&](std::size_t i) {
    tables[i] = improve(views, coarsest > 0 ? coarsest - 1 : 0, pairs, tables[i], match, 0.15 * options.radius,
                        0.06 * options.radius, 10, {!axis_given, options.step_deg == 0});
  });
  return *std::min_element(tables.begin(), tables.end(), better);
}

}  // namespace scanview
