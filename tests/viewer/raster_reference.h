#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/random.h"
#include "calib/camera.h"
#include "mesh/triangle_mesh.h"
#include "viewer/raster/id_buffer.h"
#include "viewer/raster/kernels.h"

// What the rasteriser is tested against: exact arithmetic, which shares with it the positions of vertices on the 1/256
// pixel grid, and rays, which share nothing. And meshes to draw.

namespace scanview::test {

struct Point {
  std::int64_t x = 0, y = 0;
};
std::int64_t area2(Point a, Point b, Point c);
bool owns(Point a, Point b, Point c, int x, int y);
std::vector<ScreenVertex> snapped(TriangleMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& pose);
void expect_exact(TriangleMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& pose, Culling culling,
                  double tolerance = 1e-5);
std::pair<int, double> cast(TriangleMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& pose, double u,
                            double v, Culling culling, double near = 0);
int expect_as_cast(TriangleMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& pose, Culling culling,
                   double slack = 0.01, double near = 0);
cv::Mat1i ownership(TriangleMesh const& mesh, Camera const& camera,
                    Eigen::Isometry3d const& pose = Eigen::Isometry3d::Identity());

double between(CounterRandom& random, double low, double high);
TriangleMesh random_triangles(int count, double size, std::uint64_t seed);
TriangleMesh sphere_mesh(int around, int rings);
/// (columns + 1) x (rows + 1) vertices; `at` gives the place of one.
template <typename At>
TriangleMesh grid(int columns, int rows, At const& at) {
  TriangleMesh mesh;
  for (int y = 0; y <= rows; ++y) {
    for (int x = 0; x <= columns; ++x) mesh.vertices.push_back(Eigen::Vector3d(at(x, y)).template cast<float>());
  }
  for (int y = 0; y < rows; ++y) {
    for (int x = 0; x < columns; ++x) {
      int const a = y * (columns + 1) + x, b = a + 1, c = a + columns + 1, d = c + 1;
      // Both diagonals.
      if ((x + y) % 2 == 0) {
        mesh.triangles.emplace_back(a, c, b);
        mesh.triangles.emplace_back(b, c, d);
      } else {
        mesh.triangles.emplace_back(a, c, d);
        mesh.triangles.emplace_back(a, d, b);
      }
    }
  }
  return mesh;
}

}  // namespace scanview::test
