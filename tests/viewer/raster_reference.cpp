#include "viewer/raster_reference.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "viewer/view_based/view_transform.h"

namespace scanview::test {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Twice the area of a, b, c; positive where they run clockwise on the screen (y down).
std::int64_t area2(Point a, Point b, Point c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

/// Whether a triangle owns a pixel's centre: inside, or on an edge that goes up or, level, to the right when running
/// clockwise (its left or top one). Exact.
bool owns(Point a, Point b, Point c, int x, int y) {
  if (area2(a, b, c) == 0) return false;
  if (area2(a, b, c) < 0) std::swap(b, c);
  Point const p{256 * std::int64_t{x}, 256 * std::int64_t{y}};
  auto const beside = [&](Point from, Point to) {
    std::int64_t const side = area2(from, to, p);
    bool const left = to.y < from.y, top = to.y == from.y && to.x > from.x;
    return side > 0 || (side == 0 && (left || top));
  };
  return beside(a, b) && beside(b, c) && beside(c, a);
}

std::vector<ScreenVertex> snapped(TriangleMesh const& mesh, Camera const& camera, Isometry3d const& pose) {
  Eigen::AlignedBox3d bounds;
  for (auto const& vertex : mesh.vertices) bounds.extend(vertex.cast<double>());
  DepthRange range;
  EXPECT_TRUE(depth_range(bounds, pose.inverse(), camera.is_perspective(), range));
  RasterMesh const raster = raster_mesh(mesh, std::vector<std::uint32_t>(mesh.triangles.size()));
  std::vector<ScreenVertex> result(mesh.vertices.size());
  transform_vertices(raster.vertices, screen_transform(camera, pose.inverse(), range), 0, result.size(), camera.width(),
                     camera.height(), result.data());
  return result;
}

/// All pixels against all triangles, of which none is clipped: the same pixels exactly; where several triangles own a
/// pixel the nearest, as far as single precision can tell. `tolerance`: of 1/z or z, relative to the largest.
void expect_exact(TriangleMesh const& mesh, Camera const& camera, Isometry3d const& pose, Culling culling,
                  double tolerance) {
  auto const vertices = snapped(mesh, camera, pose);
  double largest = 0;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    ASSERT_NE(vertices[i].x, kBeyond);
    Vector3d const p = pose.inverse() * mesh.vertices[i].cast<double>();
    Eigen::Vector2d const at = 256 * camera.project(p);
    // Half a step of rounding, and single precision of up to a few thousand pixels.
    ASSERT_NEAR(vertices[i].x, at.x(), 0.5 + 3e-7 * std::abs(at.x()) + 0.05);
    ASSERT_NEAR(vertices[i].y, at.y(), 0.5 + 3e-7 * std::abs(at.y()) + 0.05);
    largest = std::max(largest, std::abs(double{vertices[i].values[ScreenVertex::key]}));
  }
  cv::Mat1d best(camera.height(), camera.width(), -INFINITY);
  IdBuffer const drawn = draw_id_buffer(mesh, camera, pose, culling);
  cv::Mat1d of_drawn(camera.height(), camera.width(), NAN);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Point p[3];
    double key[3];
    for (int k = 0; k < 3; ++k) {
      auto const& v = vertices[static_cast<std::size_t>(mesh.triangles[t][k])];
      p[k] = {v.x, v.y};
      key[k] = v.values[ScreenVertex::key];
    }
    std::int64_t const area = area2(p[0], p[1], p[2]);
    if (culling == Culling::back_faces && area > 0) continue;
    auto const [left, right] = std::minmax({p[0].x, p[1].x, p[2].x});
    auto const [top, bottom] = std::minmax({p[0].y, p[1].y, p[2].y});
    for (int y = std::max(0, int(top / 256) - 1); y <= std::min(camera.height() - 1, int(bottom / 256) + 1); ++y) {
      for (int x = std::max(0, int(left / 256) - 1); x <= std::min(camera.width() - 1, int(right / 256) + 1); ++x) {
        if (!owns(p[0], p[1], p[2], x, y)) continue;
        Point const c{256 * std::int64_t{x}, 256 * std::int64_t{y}};
        double const sum = double(area2(p[1], p[2], c)) * key[0] + double(area2(p[2], p[0], c)) * key[1] +
                           double(area2(p[0], p[1], c)) * key[2];
        best(y, x) = std::max(best(y, x), sum / double(area));
        if (drawn.id(y, x) == int(t)) of_drawn(y, x) = sum / double(area);
      }
    }
  }
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      ASSERT_EQ(drawn.id(y, x) == kNoTriangle, best(y, x) == -INFINITY) << x << ' ' << y;
      ASSERT_EQ(drawn.id(y, x) == kNoTriangle, std::isnan(drawn.depth(y, x))) << x << ' ' << y;
      if (drawn.id(y, x) == kNoTriangle) continue;
      // NaN where the triangle that was drawn does not own the pixel.
      ASSERT_GE(of_drawn(y, x), best(y, x) - tolerance * largest) << x << ' ' << y;
      double const key = camera.is_perspective() ? 1.0 / drawn.depth(y, x) : -drawn.depth(y, x);
      ASSERT_NEAR(key, of_drawn(y, x), tolerance * largest) << x << ' ' << y;
    }
  }
}

/// The nearest triangle on the ray of a place in the picture, and its depth.
std::pair<int, double> cast(TriangleMesh const& mesh, Camera const& camera, Isometry3d const& pose, double u, double v,
                            Culling culling, double near) {
  Vector3d const origin = pose * camera.ray_origin(u, v), direction = pose.linear() * camera.ray_direction(u, v);
  std::pair<int, double> nearest{kNoTriangle, INFINITY};
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    Vector3d const a = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][0])].cast<double>();
    Vector3d const ab = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][1])].cast<double>() - a;
    Vector3d const ac = mesh.vertices[static_cast<std::size_t>(mesh.triangles[t][2])].cast<double>() - a;
    Vector3d const n = ab.cross(ac);
    double const facing = n.dot(direction);
    if (facing == 0 || (culling == Culling::back_faces && facing > 0)) continue;
    double const depth = n.dot(a - origin) / facing;  // directions have z = 1, origins z = 0
    Vector3d const p = origin + depth * direction - a;
    double const s = p.cross(ac).dot(n) / n.squaredNorm(), r = ab.cross(p).dot(n) / n.squaredNorm();
    if (s < 0 || r < 0 || s + r > 1) continue;
    if (camera.is_perspective() && depth <= near) continue;
    if (depth < nearest.second) nearest = {int(t), depth};
  }
  return nearest;
}

/// Against a ray caster: equal where rays up to `slack` pixels beside the centre agree. How many pixels were compared.
int expect_as_cast(TriangleMesh const& mesh, Camera const& camera, Isometry3d const& pose, Culling culling,
                   double slack, double near) {
  IdBuffer const drawn = draw_id_buffer(mesh, camera, pose, culling);
  int compared = 0, wrong = 0;
  for (int y = 0; y < camera.height(); ++y) {
    for (int x = 0; x < camera.width(); ++x) {
      auto const truth = cast(mesh, camera, pose, x, y, culling, near);
      bool certain = true;
      double slope = 0;
      for (auto const& [dx, dy] :
           {std::pair(slack, slack), std::pair(-slack, slack), std::pair(slack, -slack), std::pair(-slack, -slack)}) {
        auto const beside = cast(mesh, camera, pose, x + dx, y + dy, culling, near);
        certain = certain && beside.first == truth.first;
        slope = std::max(slope, std::abs(beside.second - truth.second));
      }
      if (!certain) continue;
      ++compared;
      wrong += drawn.id(y, x) != truth.first;
      if (truth.first == kNoTriangle || drawn.id(y, x) != truth.first) continue;
      EXPECT_NEAR(drawn.depth(y, x), truth.second, slope + 1e-5 * (1 + std::abs(truth.second))) << x << ' ' << y;
    }
  }
  EXPECT_EQ(wrong, 0);
  return compared;
}

/// How many of the mesh's triangles own each pixel, each drawn alone.
cv::Mat1i ownership(TriangleMesh const& mesh, Camera const& camera, Isometry3d const& pose) {
  cv::Mat1i count(camera.height(), camera.width(), 0);
  for (auto const& triangle : mesh.triangles) {
    TriangleMesh alone;
    alone.vertices = mesh.vertices;  // all of them: the same depth range
    alone.triangles = {triangle};
    IdBuffer const drawn = draw_id_buffer(alone, camera, pose);
    for (int y = 0; y < count.rows; ++y) {
      for (int x = 0; x < count.cols; ++x) count(y, x) += drawn.id(y, x) == 0;
    }
  }
  return count;
}

double between(CounterRandom& random, double low, double high) { return low + (high - low) * random.uniform(); }

/// Triangles at random places before a camera that looks along +z from the origin.
TriangleMesh random_triangles(int count, double size, std::uint64_t seed) {
  CounterRandom random(seed, 0);
  TriangleMesh mesh;
  for (int i = 0; i < count; ++i) {
    Vector3d const middle(between(random, -1, 1), between(random, -1, 1), between(random, 3, 5));
    for (int k = 0; k < 3; ++k) {
      Vector3d const p = middle + size * Vector3d(random.normal(), random.normal(), random.normal());
      mesh.vertices.push_back(p.cast<float>());
    }
    mesh.triangles.emplace_back(3 * i, 3 * i + 1, 3 * i + 2);
  }
  return mesh;
}

/// Of a unit sphere, counter-clockwise from outside.
TriangleMesh sphere_mesh(int around, int rings) {
  TriangleMesh mesh;
  for (int r = 0; r <= rings; ++r) {
    double const e = std::numbers::pi * r / rings;
    for (int i = 0; i < around; ++i) {
      double const a = 2 * std::numbers::pi * i / around;
      mesh.vertices.push_back(
          Vector3d(std::sin(e) * std::sin(a), std::cos(e), std::sin(e) * std::cos(a)).cast<float>());
    }
  }
  for (int r = 0; r < rings; ++r) {
    for (int i = 0; i < around; ++i) {
      int const a = r * around + i, b = r * around + (i + 1) % around, c = a + around, d = b + around;
      if (r > 0) mesh.triangles.emplace_back(a, c, b);
      if (r + 1 < rings) mesh.triangles.emplace_back(b, c, d);
    }
  }
  return mesh;
}

}  // namespace scanview::test
