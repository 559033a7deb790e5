#pragma once
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "acquire/range_image.h"
#include "mesh/triangle_mesh.h"

namespace scanview::testing {

/// What a mesh does to the pixels of a range image, found without anything of the mesher: every pixel centre against
/// every triangle. A centre is covered where it lies in the triangle that the camera projects from its single
/// precision vertices, or within 1e-9 pixels of it (both triangles at an edge have it); the depth is where the pixel's
/// ray meets the triangle's plane.
struct ReferenceRaster {
  cv::Mat1i count;        ///< triangles that cover the centre
  cv::Mat1d worst_error;  ///< greatest |depth − image's| of them, where the image has one
  std::size_t object = 0, uncovered = 0, covered_background = 0;
  double max_error = 0;
  double squares = 0;  ///< of the worst errors, summed
  double max_over_sigma = 0;
};

/// Calls visit(x, y, depth) for every pixel centre that a triangle covers; the depth is NaN where it is seen from its
/// edge.
template <typename Visit>
void for_each_centre(Camera const& camera, TriangleMesh const& mesh, Eigen::Vector3i const& triangle, Visit&& visit) {
  Eigen::Vector3d p[3];
  Eigen::Vector2d u[3];
  for (int i = 0; i < 3; ++i) {
    p[i] = mesh.vertices[triangle[i]].cast<double>();
    u[i] = camera.project(p[i]);
  }
  Eigen::Vector3d const normal = (p[1] - p[0]).cross(p[2] - p[0]);
  Eigen::Vector2d const low = u[0].cwiseMin(u[1]).cwiseMin(u[2]), high = u[0].cwiseMax(u[1]).cwiseMax(u[2]);
  for (int y = std::max(0, int(low.y()) - 1); y <= std::min(camera.height() - 1, int(high.y()) + 1); ++y)
    for (int x = std::max(0, int(low.x()) - 1); x <= std::min(camera.width() - 1, int(high.x()) + 1); ++x) {
      double nearest_positive = INFINITY, nearest_negative = INFINITY;
      for (int i = 0; i < 3; ++i) {
        Eigen::Vector2d const edge = u[(i + 1) % 3] - u[i], to = Eigen::Vector2d(x, y) - u[i];
        double const distance = (edge.x() * to.y() - edge.y() * to.x()) / edge.norm();
        nearest_positive = std::min(nearest_positive, distance);
        nearest_negative = std::min(nearest_negative, -distance);
      }
      if (!(nearest_positive >= -1e-9) && !(nearest_negative >= -1e-9)) continue;
      Eigen::Vector3d const origin = camera.ray_origin(x, y), direction = camera.ray_direction(x, y);
      visit(x, y, origin.z() + normal.dot(p[0] - origin) / normal.dot(direction) * direction.z());
    }
}

inline ReferenceRaster reference_raster(RangeImage const& image, TriangleMesh const& mesh) {
  Camera const& camera = image.camera;
  ReferenceRaster result;
  result.count = cv::Mat1i::zeros(image.depth.size());
  result.worst_error = cv::Mat1d::zeros(image.depth.size());
  for (Eigen::Vector3i const& triangle : mesh.triangles)
    for_each_centre(camera, mesh, triangle, [&](int x, int y, double z) {
      ++result.count(y, x);
      if (!image.has_depth(x, y)) return;
      double const error = std::abs(z - image.depth(y, x));
      // NaN must not pass as small.
      if (!(error <= result.worst_error(y, x))) result.worst_error(y, x) = error;
    });
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      if (!image.has_depth(x, y)) {
        result.covered_background += result.count(y, x) > 0;
        continue;
      }
      ++result.object;
      result.uncovered += result.count(y, x) == 0;
      result.squares += result.worst_error(y, x) * result.worst_error(y, x);
      if (!(result.worst_error(y, x) <= result.max_error)) result.max_error = result.worst_error(y, x);
      double const relative = result.worst_error(y, x) / image.sigma(y, x);
      if (!(relative <= result.max_over_sigma)) result.max_over_sigma = relative;
    }
  return result;
}

}  // namespace scanview::testing
