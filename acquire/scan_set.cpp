#include "acquire/scan_set.h"

#include <algorithm>
#include <cmath>

#include "base/error.h"

namespace scanview {
namespace {

/// Every stride-th depth of all views with poses, in object coordinates: about `target` points.
std::vector<Eigen::Vector3d> thinned_points(ScanSet const& set, std::size_t target) {
  std::size_t total = 0;
  for (auto const& view : set.views)
    if (view.object_from_camera) total += view.image.count_depths();
  std::size_t const stride = std::max<std::size_t>(1, total / target);
  std::vector<Eigen::Vector3d> points;
  points.reserve(total / stride + 1);
  std::size_t index = 0;
  for (auto const& view : set.views) {
    if (!view.object_from_camera) continue;
    for (int y = 0; y < view.image.depth.rows; ++y)
      for (int x = 0; x < view.image.depth.cols; ++x)
        if (view.image.has_depth(x, y) && index++ % stride == 0)
          points.push_back(*view.object_from_camera * view.image.point(x, y));
  }
  return points;
}

constexpr std::size_t kThinnedPoints = 100'000;

/// The value below which `share` of the values lie. Values must not be empty.
double quantile(std::vector<double>& values, double share) {
  auto const at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

}  // namespace

Eigen::Vector3d View::eye() const {
  return object_from_camera ? Eigen::Vector3d(object_from_camera->translation())
                            : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

std::string to_string(Unit unit) {
  switch (unit) {
    case Unit::mm:
      return "mm";
    case Unit::m:
      return "m";
    case Unit::arbitrary:
      return "arbitrary";
  }
  return {};
}

Unit unit_from_string(std::string const& name, std::filesystem::path const& path) {
  for (Unit const unit : {Unit::mm, Unit::m, Unit::arbitrary})
    if (to_string(unit) == name) return unit;
  throw Error(ErrorCode::bad_input, path, "unit '" + name + "' is none of mm, m, arbitrary");
}

double ErrorBudget::threshold() const {
  double sum = 0;
  for (auto const& part : {sampling, registration, approximation})
    if (std::isfinite(part.p95)) sum += part.p95;
  return sum;
}

bool ScanSet::has_poses() const {
  return !views.empty() &&
         std::all_of(views.begin(), views.end(), [](View const& v) { return v.object_from_camera.has_value(); });
}

double ScanSet::radius() const {
  std::vector<double> distances;
  for (auto const& p : thinned_points(*this, kThinnedPoints)) distances.push_back((p - center).norm());
  return distances.empty() ? 0 : quantile(distances, 0.99);
}

Eigen::Vector3d median_center(ScanSet const& set) {
  auto const points = thinned_points(set, kThinnedPoints);
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  if (points.empty()) return center;
  std::vector<double> values(points.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::transform(points.begin(), points.end(), values.begin(), [&](auto const& p) { return p[axis]; });
    center[axis] = quantile(values, 0.5);
  }
  return center;
}

}  // namespace scanview
