#include "mesh/depth_triangulation.h"

#include <gtest/gtest.h>

#include <map>
#include <numbers>

#include "base/random.h"
#include "mesh/depth_fit.h"
#include "mesh/joint_fit.h"
#include "mesh/pixel_spans.h"
#include "tests/mesh/depth_maps.h"

namespace scanview {
namespace {

using namespace testing;

/// A square over `size` pixels a side, of two triangles.
DepthTriangulation square(int size) {
  DepthTriangulation m;
  double const low = -0.5, high = size - 0.5;
  for (auto const& [x, y] : {std::pair(low, low), std::pair(high, low), std::pair(high, high), std::pair(low, high)})
    m.add_vertex({x, y}, 0, true);
  m.add_triangle(0, 1, 2);
  m.add_triangle(0, 2, 3);
  m.connect();
  return m;
}

/// Every pixel is in exactly one triangle, all turn from x to y, and neighbours know each other.
void expect_sound(DepthTriangulation const& m, int size) {
  cv::Mat1i count = cv::Mat1i::zeros(size, size);
  std::map<std::pair<int, int>, std::pair<int, int>> edges;
  int alive = 0;
  for (int t = 0; t < int(m.triangles().size()); ++t) {
    if (!m.alive(t)) continue;
    ++alive;
    DepthTriangle const shape = m.shape(t);
    ASSERT_GT(shape.turn(), 0) << t;
    for_each_span(shape.corner[0], shape.corner[1], shape.corner[2], size, size, [&](int y, int begin, int end) {
      for (int x = begin; x < end; ++x) ++count(y, x);
    });
    for (int i = 0; i < 3; ++i) {
      auto const edge = std::pair(m.triangle(t).vertex[(i + 1) % 3], m.triangle(t).vertex[(i + 2) % 3]);
      ASSERT_TRUE(edges.try_emplace(edge, t, i).second);
      int const n = m.triangle(t).next[i];
      if (n >= 0) {
        ASSERT_TRUE(m.alive(n));
        ASSERT_LT(m.opposite_of(n, t), 3);
      }
    }
  }
  EXPECT_EQ(alive, m.count());
  for (auto const& [edge, at] : edges) {
    auto const other = edges.find({edge.second, edge.first});
    EXPECT_EQ(m.triangle(at.first).next[at.second], other == edges.end() ? -1 : other->second.first);
  }
  for (int v = 0; v < int(m.vertices().size()); ++v)
    if (int const t = m.vertex(v).triangle; t >= 0) {
      ASSERT_LT(m.corner_of(t, v), 3);
    }
  EXPECT_EQ(cv::countNonZero(count != 1), 0);
}

DepthField field_of(int size, std::function<double(int, int)> const& depth) {
  RangeImage const image = depth_map(small_orthographic(size, size), 1, depth);
  SurfaceLinks const links = find_surface_links(image, 1e9, 1);
  return make_depth_field(image, links, cv::Mat1f(size, size, 1.0f));
}

TEST(DepthTriangulation, StaysAPartitionUnderRandomChanges) {
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    SCOPED_TRACE(seed);
    constexpr int kSize = 40;
    DepthTriangulation m = square(kSize);
    std::vector<int> around;
    for (std::uint64_t step = 0; step < 600; ++step) {
      CounterRandom random(seed, step);
      auto const any = [&](std::size_t count) { return int(random.uniform() * double(count)); };
      int const t = any(m.triangles().size());
      if (!m.alive(t)) continue;
      DepthTriangle const shape = m.shape(t);
      switch (any(5)) {
        case 0: {  // on a pixel, often on an edge or a corner
          Eigen::Vector2d const p(std::round(shape.corner[0].x()), std::round(shape.corner[1].y()));
          bool inside = true;
          for (int i = 0; i < 3; ++i) {
            Eigen::Vector2d const edge = shape.corner[(i + 1) % 3] - shape.corner[i], to = p - shape.corner[i];
            inside = inside && edge.x() * to.y() - edge.y() * to.x() >= 0;
          }
          if (inside) m.insert(t, p, 0);
          break;
        }
        case 1:
          if (shape.turn() > 1e-3) m.insert(t, (shape.corner[0] + shape.corner[1] + shape.corner[2]) / 3, 0);
          break;
        case 2: {
          int const i = any(3);
          if (m.can_flip(t, i)) m.flip(t, i);
          break;
        }
        case 3: {
          int const v = m.triangle(t).vertex[any(3)];
          Eigen::Vector2d const to =
              m.vertex(v).position + 3 * Eigen::Vector2d(random.uniform() - 0.5, random.uniform() - 0.5);
          if (m.can_move(v, to)) m.move(v, to, 0);
          break;
        }
        default: {
          int const i = any(3), v = m.triangle(t).vertex[i], u = m.triangle(t).vertex[(i + 1) % 3];
          if (m.can_collapse(v, u)) m.collapse(v, u);
        }
      }
    }
    expect_sound(m, kSize);
  }
}

TEST(DepthTriangulation, SplittingTheBorderAndInsertingOnEdges) {
  DepthTriangulation m = square(8);
  ASSERT_TRUE(m.insert(0, {3.5, 3.5}, 0));  // on the diagonal
  EXPECT_EQ(m.count(), 4);
  EXPECT_FALSE(m.insert(m.vertex(4).triangle, {3.5, 3.5}, 0)) << "there already";
  int const before = m.count();
  for (int t = 0; t < before; ++t)
    for (int i = 0; i < 3; ++i)
      if (m.triangle(t).next[i] < 0) {
        DepthTriangle const shape = m.shape(t);
        m.split_edge(t, i, (shape.corner[(i + 1) % 3] + shape.corner[(i + 2) % 3]) / 2, 0);
        break;
      }
  EXPECT_EQ(m.count(), 8);
  expect_sound(m, 8);
}

TEST(DepthTriangulation, InsertionKeepsItDelaunay) {
  DepthTriangulation m = square(64);
  for (std::uint64_t k = 0; k < 200; ++k) {
    CounterRandom random(3, k);
    Eigen::Vector2d const p(std::floor(64 * random.uniform()), std::floor(64 * random.uniform()));
    for (int t = 0; t < int(m.triangles().size()); ++t) {
      DepthTriangle const shape = m.shape(t);
      bool inside = true;
      for (int i = 0; i < 3; ++i) {
        Eigen::Vector2d const edge = shape.corner[(i + 1) % 3] - shape.corner[i], to = p - shape.corner[i];
        inside = inside && edge.x() * to.y() - edge.y() * to.x() >= 0;
      }
      if (!inside) continue;
      if (auto const v = m.insert(t, p, 0)) m.restore_delaunay(*v);
      break;
    }
  }
  expect_sound(m, 64);
  for (int t = 0; t < int(m.triangles().size()); ++t)
    for (int i = 0; i < 3; ++i) EXPECT_FALSE(m.breaks_delaunay(t, i));
}

TEST(DepthField, SumsGiveTheNormalEquationsThatBruteForceGives) {
  DepthField const field = field_of(40, [](int x, int y) { return 5 + 0.1 * x + std::sin(0.3 * x * y); });
  DepthTriangle const shape{{{3.25, 2.5}, {35.125, 7.75}, {11, 38.5}}, {4, 6, 5}};
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  double squares = 0, worst = 0;
  int pixels = 0;
  for (int y = 0; y < 40; ++y)
    for (int x = 0; x < 40; ++x) {
      Eigen::Matrix3d system;
      for (int i = 0; i < 3; ++i) system.col(i) << shape.corner[i].x(), shape.corner[i].y(), 1;
      Eigen::Vector3d const weights = system.inverse() * Eigen::Vector3d(x, y, 1);
      if (weights.minCoeff() < 0) continue;
      ++pixels;
      double const error =
          field.depth(y, x) - weights.dot(Eigen::Vector3d(shape.depth[0], shape.depth[1], shape.depth[2]));
      matrix += weights * weights.transpose();
      right += error * weights;
      squares += error * error;
      worst = std::max(worst, std::abs(error));
    }
  TriangleSums const sums = scan_sums(field, shape);
  CornerEquations const equations = corner_equations(shape, sums);
  TriangleError const error = scan_error(field, shape);
  EXPECT_EQ(sums.pixels, pixels);
  // Sums of some 600 numbers of single precision, of which none is above 6.
  double const kRounding = 600 * 6 * 1.2e-7;
  EXPECT_LT((equations.matrix - matrix).norm(), kRounding);
  EXPECT_LT((equations.right - right).norm(), kRounding);
  EXPECT_NEAR(error.squares, squares, kRounding * 6);
  EXPECT_NEAR(error.worst, worst, 1e-5);
  EXPECT_NEAR(std::abs(field.depth(error.row, find_worst_column(field, shape, error)) -
                       shape.plane().at({double(find_worst_column(field, shape, error)), double(error.row)})),
              worst, 1e-5);
}

TEST(FitDepths, FindsThePlaneThatIsThere) {
  auto const plane = [](double x, double y) { return 7 + 0.3 * x - 0.2 * y; };
  DepthField const field = field_of(32, [&](int x, int y) { return plane(x, y); });
  DepthTriangulation m = square(32);
  for (Eigen::Vector2d const& p : {Eigen::Vector2d(10, 5), Eigen::Vector2d(20, 4)}) m.insert(0, p, 3);
  // What holds each vertex at its wrong depth is a twentieth of a pixel: each fit leaves a small part of the rest.
  for (int round = 0; round < 4; ++round) fit_depths(m, field, INFINITY, scan_errors(m, field));
  for (auto const& v : m.vertices()) EXPECT_NEAR(v.depth, plane(v.position.x(), v.position.y()), 1e-4);
}

TEST(FitDepths, NoErrorGrowsBeyondTheLimit) {
  DepthField const field =
      field_of(48, [](int x, int y) { return 10 + 3 * std::sin(0.2 * x) * std::cos(0.17 * y) + (x == 20 ? 0.8 : 0); });
  DepthTriangulation m = square(48);
  for (int k = 0; k < 40; ++k) {
    CounterRandom random(2, std::uint64_t(k));
    int const t = int(random.uniform() * m.count());
    DepthTriangle const s = m.shape(t);
    Eigen::Vector2d const p = (s.corner[0] + s.corner[1] + s.corner[2]) / 3;
    if (auto const v = m.insert(t, p, field.depth(int(p.y()), int(p.x())))) m.restore_delaunay(*v);
  }
  std::vector<TriangleError> const before = scan_errors(m, field);
  std::vector<TriangleError> const after = fit_depths(m, field, 1.0, before);
  double old_squares = 0, squares = 0;
  for (std::size_t t = 0; t < before.size(); ++t) {
    EXPECT_LE(after[t].worst, std::max(1.0f, before[t].worst));
    old_squares += before[t].squares;
    squares += after[t].squares;
  }
  EXPECT_LT(squares, old_squares);

  Context context;
  float limit = 1;
  for (TriangleError const& error : after) limit = std::max(limit, error.worst);
  int const count = m.count();
  JointFitOptions options;
  options.limit = limit;
  options.fewer = false;
  double joint_squares = 0;
  for (TriangleError const& error : fit_jointly(m, field, options, after, context)) {
    EXPECT_LE(error.worst, limit);
    joint_squares += error.squares;
  }
  EXPECT_EQ(m.count(), count);
  EXPECT_LT(joint_squares, 0.8 * squares);
  expect_sound(m, 48);
}

}  // namespace
}  // namespace scanview
