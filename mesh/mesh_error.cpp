#include "mesh/mesh_error.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "mesh/depth_field.h"
#include "mesh/pixel_spans.h"
#include "mesh/surface_links.h"

namespace scanview {

MeshError measure_mesh(RangeImage const& image, TriangleMesh const& mesh) {
  Camera const& camera = image.camera;
  cv::Mat1d nearest(camera.height(), camera.width(), INFINITY);
  for (Eigen::Vector3i const& triangle : mesh.triangles) {
    DepthTriangle shape;
    for (int i = 0; i < 3; ++i) {
      Eigen::Vector3d const p = mesh.vertices[triangle[i]].cast<double>();
      shape.corner[i] = camera.project(p);
      shape.depth[i] = linear_depth(camera, p.z());
    }
    DepthPlane const plane = shape.plane();
    for_each_span(shape.corner[0], shape.corner[1], shape.corner[2], camera.width(), camera.height(),
                  [&](int y, int begin, int end) {
                    for (int x = begin; x < end; ++x) {
                      double const z = linear_depth(camera, plane.at({double(x), double(y)}));
                      nearest(y, x) = std::min(nearest(y, x), z);
                    }
                  });
  }

  MeshError result;
  result.figures.triangles = mesh.triangles.size();
  result.covered = cv::Mat1b::zeros(camera.height(), camera.width());
  std::vector<float> errors;
  errors.reserve(std::size_t(camera.width()) * camera.height());
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
      errors.push_back(float(error));
      result.figures.max = std::max(result.figures.max, error);
      squares += error * error;
    }
  if (object > 0) result.figures.uncovered = double(object - errors.size()) / double(object);
  if (errors.empty()) return result;
  result.figures.rms = std::sqrt(squares / double(errors.size()));
  auto const at = errors.begin() + std::ptrdiff_t(0.95 * double(errors.size() - 1));
  std::nth_element(errors.begin(), at, errors.end());
  result.figures.p95 = *at;
  return result;
}

}  // namespace scanview
