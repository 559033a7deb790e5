#include "viewer/select/view_selection.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/median.h"

namespace scanview {

using Eigen::Vector3d;

Vector3d direction_to_eye(Camera const& camera, Eigen::Isometry3d const& object_from_camera, Vector3d const& center) {
  Vector3d const backward = -object_from_camera.linear().col(2);
  if (!camera.is_perspective()) return backward.normalized();
  Vector3d const to_eye = object_from_camera.translation() - center;
  double const length = to_eye.stableNorm();
  // Closer than rounding of the coordinates can tell from the centre.
  if (length <= 1e-12 * (1e-30 + center.cwiseAbs().maxCoeff())) return backward.normalized();
  return (to_eye / length).normalized();
}

std::vector<UsedView> add_fill_views(std::vector<ViewWeight> const& main, std::vector<Vector3d> const& directions,
                                     Vector3d const& eye, int fill_views) {
  std::vector<UsedView> all(directions.size());
  for (std::size_t i = 0; i < all.size(); ++i) all[i].view = i;
  for (auto const& view : main) all[view.view].weight = view.weight;

  if (fill_views > 0) {
    struct Near {
      double angle;
      std::size_t view;
      bool operator<(Near const& other) const { return angle != other.angle ? angle < other.angle : view < other.view; }
    };
    std::vector<Near> nearest;
    for (std::size_t i = 0; i < directions.size(); ++i) {
      Vector3d const direction = directions[i].normalized();
      nearest.push_back({std::atan2(direction.cross(eye).norm(), direction.dot(eye)), i});
    }
    std::sort(nearest.begin(), nearest.end());
    std::size_t const count = std::min(nearest.size(), 3 + static_cast<std::size_t>(fill_views));
    // A little beyond the antipode where no view is left out: every view then fills a little.
    double const horizon = count < nearest.size() ? nearest[count].angle : 1.01 * std::numbers::pi;
    for (std::size_t i = 0; i < count && horizon > 0; ++i) all[nearest[i].view].fill = 1 - nearest[i].angle / horizon;
  }
  std::erase_if(all, [](UsedView const& view) { return view.weight <= 0 && view.fill <= 0; });
  return all;
}

double median_spacing(std::vector<Vector3d> const& directions) {
  constexpr double kLeastSpacing = 0.05;
  std::vector<double> nearest;
  for (std::size_t i = 0; i < directions.size(); ++i) {
    double least = std::numbers::pi;
    for (std::size_t j = 0; j < directions.size(); ++j) {
      if (j == i) continue;
      least = std::min(least, std::atan2(directions[i].cross(directions[j]).norm(), directions[i].dot(directions[j])));
    }
    nearest.push_back(std::max(least, kLeastSpacing));
  }
  return median(std::move(nearest));
}

double fill_rank(std::vector<UsedView> const& views) {
  double greatest = 0;
  for (auto const& view : views) greatest = std::max(greatest, view.weight);
  return std::clamp(3 * (1 - greatest), 1e-3, 1.0);
}

}  // namespace scanview
