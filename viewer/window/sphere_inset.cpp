#include "viewer/window/sphere_inset.h"

#include <algorithm>
#include <cmath>
#include <set>

namespace scanview {
namespace {

using Eigen::Vector3d;

SpherePoint project(Eigen::Matrix3d const& object_from_camera, Vector3d const& direction) {
  Vector3d const d = object_from_camera.transpose() * direction;
  // The camera looks along +z: what it sees of the sphere lies towards it.
  return {d.x(), d.y(), d.z() <= 0};
}

std::vector<Vector3d> great_arc(Vector3d const& a, Vector3d const& b) {
  constexpr double kStep = 0.15;
  double const angle = std::atan2(a.cross(b).norm(), a.dot(b));
  Vector3d axis = a.cross(b);
  axis = axis.norm() > 1e-9 ? Vector3d(axis.normalized()) : a.unitOrthogonal();
  int const steps = std::max(1, static_cast<int>(std::ceil(angle / kStep)));
  std::vector<Vector3d> arc;
  for (int i = 0; i <= steps; ++i) arc.push_back(Eigen::AngleAxisd(angle * i / steps, axis) * a);
  return arc;
}

}  // namespace

std::size_t SphereInset::nearest(double x, double y, double reach) const {
  std::size_t best = views.size();
  for (bool const front : {true, false}) {
    double least = reach;
    for (std::size_t i = 0; i < views.size(); ++i) {
      double const distance = std::hypot(views[i].at.x - x, views[i].at.y - y);
      if (views[i].at.front != front || distance > least) continue;
      least = distance;
      best = i;
    }
    if (best < views.size()) break;
  }
  return best < views.size() ? views[best].view : views.size();
}

SphereInset sphere_inset(std::vector<Vector3d> const& directions, std::vector<Eigen::Vector3i> const& triangles,
                         std::vector<UsedView> const& used, Vector3d const& eye,
                         Eigen::Matrix3d const& object_from_camera) {
  SphereInset inset;
  for (std::size_t i = 0; i < directions.size(); ++i)
    inset.views.push_back({i, project(object_from_camera, directions[i]), 0, false});
  for (auto const& view : used) {
    inset.views[view.view].weight = view.weight;
    inset.views[view.view].drawn = true;
    if (view.weight > 0) inset.chosen.push_back(inset.views[view.view].at);
  }
  std::set<std::pair<int, int>> seen;
  for (auto const& triangle : triangles) {
    for (int k = 0; k < 3; ++k) {
      auto const [a, b] = std::minmax(triangle[k], triangle[(k + 1) % 3]);
      if (!seen.emplace(a, b).second) continue;
      auto const from = static_cast<std::size_t>(a), to = static_cast<std::size_t>(b);
      SphereInset::Edge edge;
      for (auto const& direction : great_arc(directions[from], directions[to]))
        edge.arc.push_back(project(object_from_camera, direction));
      edge.chosen = inset.views[from].weight > 0 && inset.views[to].weight > 0;
      inset.edges.push_back(std::move(edge));
    }
  }
  inset.eye = project(object_from_camera, eye);
  return inset;
}

}  // namespace scanview
