#include "mesh/mesh_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh/surface_links.h"
#include "mesh/triangle_scan.h"

namespace scanview {

MeshError measure_mesh(RangeImage const& image, TriangleMesh const& mesh) {
  Camera const& camera = image.camera;
  cv::Mat1d nearest(camera.height(), camera.width(), INFINITY);
  for (Eigen::Vector3i const& triangle : mesh.triangles) {
    Eigen::Vector2d corners[3];
    double depths[3];
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d const p = mesh.vertices[triangle[i]].cast<double>();
      corners[i] = camera.project(p);
      depths[i] = linear_depth(camera, p.z());
    }
    for_each_pixel(corners[0], corners[1], corners[2], camera.width(), camera.height(),
                   [&](int x, int y, double wa, double wb, double wc) {
                     double const z = linear_depth(camera, wa * depths[0] + wb * depths[1] + wc * depths[2]);
                     nearest(y, x) = std::min(nearest(y, x), z);
                   });
  }

  MeshError result;
  result.figures.triangles = mesh.triangles.size();
  result.covered = cv::Mat1b::zeros(camera.height(), camera.width());
  std::vector<double> errors;
  std::size_t object = 0;
  double squares = 0;
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      bool const covered = std::isfinite(nearest(y, x));
      result.covered(y, x) = covered ? 255 : 0;
      if (!image.has_depth(x, y)) continue;
      ++object;
      if (!covered) continue;
      double const error = std::abs(nearest(y, x) - image.depth(y, x));
      errors.push_back(error);
      squares += error * error;
    }
  if (object > 0) result.figures.uncovered = double(object - errors.size()) / double(object);
  if (errors.empty()) return result;
  result.figures.rms = std::sqrt(squares / double(errors.size()));
  result.figures.max = *std::max_element(errors.begin(), errors.end());
  auto const at = errors.begin() + std::ptrdiff_t(0.95 * double(errors.size() - 1));
  std::nth_element(errors.begin(), at, errors.end());
  result.figures.p95 = *at;
  return result;
}

}  // namespace scanview
