#include <algorithm>
#include <cmath>
#include <numbers>

#include "register/alignment.h"
#include "register/feature_match.h"
#include "register/view_surface.h"

namespace scanview {
namespace {

// Points of a view in camera coordinates, a few thousand.
std::vector<Eigen::Vector3d> thinned_points(RangeImage const& image) {
  std::vector<Eigen::Vector3d> points;
  int const step = std::max(1, std::max(image.depth.cols, image.depth.rows) / 64);
  for (int y = 0; y < image.depth.rows; y += step)
    for (int x = 0; x < image.depth.cols; x += step)
      if (image.has_depth(x, y)) points.push_back(image.point(x, y));
  return points;
}

Eigen::Vector3d mean_of(std::vector<Eigen::Vector3d> const& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (Eigen::Vector3d const& p : points) sum += p;
  return points.empty() ? sum : Eigen::Vector3d(sum / static_cast<double>(points.size()));
}

// Centre, in a's camera, of the points of a that fall on a depth of b within 5 % (of a's extent); nothing shared: of
// the object's centre.
Eigen::Vector3d shared_center(ScanSet const& set, std::size_t b, std::vector<Eigen::Vector3d> const& points_a,
                              Eigen::Isometry3d const& object_from_a, Eigen::Isometry3d const& object_from_b) {
  RangeImage const& image = set.views[b].image;
  Eigen::Isometry3d const b_from_a = object_from_b.inverse() * object_from_a;
  Eigen::Vector3d const middle = mean_of(points_a);
  double extent = 0;
  for (Eigen::Vector3d const& p : points_a) extent = std::max(extent, (p - middle).norm());
  std::vector<Eigen::Vector3d> shared;
  for (Eigen::Vector3d const& p : points_a) {
    Eigen::Vector3d const q = b_from_a * p;
    if (image.camera.is_perspective() && !(q.z() > 0)) continue;
    Eigen::Vector2d const at = image.camera.project(q);
    if (!image.camera.contains(at)) continue;
    int const x = std::clamp(static_cast<int>(std::lround(at.x())), 0, image.depth.cols - 1);
    int const y = std::clamp(static_cast<int>(std::lround(at.y())), 0, image.depth.rows - 1);
    if (image.has_depth(x, y) && std::abs(image.depth(y, x) - q.z()) < 0.05 * extent) shared.push_back(p);
  }
  return shared.empty() ? Eigen::Vector3d(object_from_a.inverse() * set.center) : mean_of(shared);
}

double angle_deg(Eigen::Matrix3d const& rotation) {
  return Eigen::AngleAxisd(Eigen::Quaterniond(rotation)).angle() * 180 / std::numbers::pi;
}

PoseComparison summary(std::vector<double> degrees, std::vector<double> lengths) {
  PoseComparison result;
  auto const median_and_max = [](std::vector<double>& values, double& median, double& max) {
    if (values.empty()) return;
    std::sort(values.begin(), values.end());
    std::size_t const n = values.size();
    median = (values[(n - 1) / 2] + values[n / 2]) / 2;
    max = values.back();
  };
  median_and_max(degrees, result.median_deg, result.max_deg);
  median_and_max(lengths, result.median_length, result.max_length);
  return result;
}

}  // namespace

PoseComparison compare_poses(ScanSet const& set, std::vector<Eigen::Isometry3d> const& poses,
                             std::vector<Eigen::Isometry3d> const& reference) {
  std::vector<double> degrees, lengths;
  for (std::size_t a = 0; a < set.views.size(); ++a) {
    std::vector<Eigen::Vector3d> const points = thinned_points(set.views[a].image);
    for (std::size_t b = a + 1; b < set.views.size(); ++b) {
      Eigen::Vector3d const center = shared_center(set, b, points, reference[a], reference[b]);
      Eigen::Isometry3d const is = poses[b].inverse() * poses[a], should = reference[b].inverse() * reference[a];
      degrees.push_back(angle_deg(is.linear() * should.linear().transpose()));
      lengths.push_back((is * center - should * center).norm());
    }
  }
  return summary(std::move(degrees), std::move(lengths));
}

PoseComparison compare_poses_absolute(ScanSet const& set, std::vector<Eigen::Isometry3d> const& poses,
                                      std::vector<Eigen::Isometry3d> const& reference) {
  // Four points a view, its centre and three around it as far as its depths reach, so that places and directions count.
  std::vector<Eigen::Vector3d> centers, from, to;
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    std::vector<Eigen::Vector3d> const points = thinned_points(set.views[i].image);
    Eigen::Vector3d const center =
        points.empty() ? Eigen::Vector3d(reference[i].inverse() * set.center) : mean_of(points);
    double extent = 0;
    for (Eigen::Vector3d const& p : points) extent = std::max(extent, (p - center).norm());
    centers.push_back(center);
    for (Eigen::Vector3d const& offset :
         {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1)}) {
      from.push_back(poses[i] * (center + (extent > 0 ? extent : 1.0) * offset));
      to.push_back(reference[i] * (center + (extent > 0 ? extent : 1.0) * offset));
    }
  }
  if (from.empty()) return {};
  Eigen::Isometry3d const fit = fit_motion(from, to);
  std::vector<double> degrees, lengths;
  for (std::size_t i = 0; i < set.views.size(); ++i) {
    degrees.push_back(angle_deg((fit * poses[i]).linear() * reference[i].linear().transpose()));
    lengths.push_back((fit * (poses[i] * centers[i]) - reference[i] * centers[i]).norm());
  }
  return summary(std::move(degrees), std::move(lengths));
}

}  // namespace scanview
