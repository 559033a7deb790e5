#include "synth/scanner.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <numbers>

#include "tests/expect_error.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

SynthOptions small(int views) {
  SynthOptions options;
  options.views = views;
  options.width = 160;
  options.height = 120;
  return options;
}

bool same_bytes(cv::Mat const& a, cv::Mat const& b) {
  return a.size() == b.size() && a.type() == b.type() && std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

void expect_same(SynthResult const& a, SynthResult const& b) {
  ASSERT_EQ(a.set.views.size(), b.set.views.size());
  for (std::size_t v = 0; v < a.set.views.size(); ++v) {
    View const &x = a.set.views[v], &y = b.set.views[v];
    EXPECT_TRUE(same_bytes(x.image.depth, y.image.depth)) << v;
    EXPECT_TRUE(same_bytes(x.image.sigma, y.image.sigma)) << v;
    EXPECT_TRUE(same_bytes(x.image.color, y.image.color)) << v;
    EXPECT_TRUE(same_bytes(x.image.classes, y.image.classes)) << v;
    EXPECT_TRUE(same_bytes(a.true_depth[v], b.true_depth[v])) << v;
    EXPECT_EQ(x.object_from_camera->matrix(), y.object_from_camera->matrix()) << v;
  }
}

/// Depth at which the ray first meets a sphere, in the camera's frame; NaN where it misses.
double sphere_depth(Camera const& camera, int x, int y, Vector3d const& center, double radius) {
  Vector3d const d = camera.ray_direction(x, y);
  double const b = d.dot(center), c = center.squaredNorm() - radius * radius, aa = d.squaredNorm();
  return (b - std::sqrt(b * b - aa * c)) / aa;
}

TEST(Scanner, DepthOfASphereLiesBetweenTheSpheresAroundAndInsideItsMesh) {
  Vector3d const center(10, 20, -30);
  double const radius = 50;
  TriangleMesh const mesh = make_icosphere(center, radius, 5);
  // A triangle lies between the sphere and the smaller one that its own circumcircle's plane touches.
  double inner = radius;
  for (auto const& t : mesh.triangles) {
    Vector3d const a = mesh.vertices[t[0]].cast<double>() - center, b = mesh.vertices[t[1]].cast<double>() - center,
                   c = mesh.vertices[t[2]].cast<double>() - center;
    inner = std::min(inner, std::abs((b - a).cross(c - a).normalized().dot(a)));
  }
  Context context;
  SynthResult const result = synthesize(mesh, small(5), context);
  for (std::size_t v = 0; v < result.set.views.size(); ++v) {
    Camera const& camera = result.set.views[v].image.camera;
    Vector3d const c = result.true_poses[v].inverse() * center;
    int hits = 0;
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        double const near = sphere_depth(camera, x, y, c, radius * (1 + 1e-6));
        double const far = sphere_depth(camera, x, y, c, inner * (1 - 1e-6));
        double const depth = result.true_depth[v](y, x);
        double const rounding = 200 * 0x1p-23;  // depths are below 256
        if (std::isnan(near)) {
          EXPECT_TRUE(std::isnan(depth));
        } else if (!std::isnan(far)) {
          EXPECT_GE(depth, near - rounding);
          EXPECT_LE(depth, far + rounding);
          ++hits;
        }
      }
    EXPECT_GT(hits, 0.3 * camera.width() * camera.height());  // fills the picture: π/4 · 0.94² · 3/4 is 0.52
  }
}

TEST(Scanner, PosesCarryDepthsOntoTheObjectAndLookAtItsCentre) {
  Vector3d const center(1, 2, 3);
  TriangleMesh const mesh = make_icosphere(center, 10, 4);
  SynthOptions options = small(4);
  options.layout = SynthOptions::Layout::circle;
  options.elevation_deg = 0;
  Context context;
  SynthResult const result = synthesize(mesh, options, context);
  EXPECT_LT((result.set.center - center).norm(), 0.05);
  EXPECT_NEAR(result.radius, 10, 0.01);
  EXPECT_EQ(result.set.unit, Unit::mm);
  Isometry3d const& first = result.true_poses[0];
  // In front (+z), right is +x, the picture's y points down; the next eye is on +x.
  EXPECT_LT((first.translation() - (result.set.center + Vector3d(0, 0, 4 * result.radius))).norm(), 1e-9);
  EXPECT_LT((first.linear().col(0) - Vector3d(1, 0, 0)).norm(), 1e-12);
  EXPECT_LT((first.linear().col(1) - Vector3d(0, -1, 0)).norm(), 1e-12);
  EXPECT_GT(result.set.views[1].eye().x(), 30);
  for (View const& view : result.set.views) {
    view.image.check();
    EXPECT_NEAR(view.object_from_camera->linear().determinant(), 1, 1e-12);
    for (int y = 0; y < view.image.camera.height(); y += 3)
      for (int x = 0; x < view.image.camera.width(); x += 3)
        if (view.image.has_depth(x, y)) {
          EXPECT_NEAR((*view.object_from_camera * view.image.point(x, y) - center).norm(), 10, 0.03);  // chords
        }
  }
}

TEST(Scanner, SphereLayoutLooksFromAllAround) {
  Context context;
  SynthResult const result = synthesize(make_icosphere({0, 0, 0}, 1, 2), small(40), context);
  Vector3d sum = Vector3d::Zero();
  for (View const& view : result.set.views) {
    EXPECT_NEAR(view.eye().norm(), 4 * result.radius, 1e-9);
    sum += view.eye().normalized();
  }
  EXPECT_LT(sum.norm() / 40, 0.02);  // a Fibonacci spiral is balanced
}

TEST(Scanner, NoiseIsNormalWithTheSigmaAskedForAndUncorrelated) {
  SynthOptions options = small(3);
  options.width = 320;
  options.height = 240;
  options.noise = {0.002, 3};
  Context context;
  SynthResult const result = synthesize(make_icosphere({0, 0, 0}, 40, 4), options, context);
  double const sigma = 0.002 * result.radius;
  double n = 0, sum = 0, squares = 0, pairs = 0, products = 0, tails = 0;
  double colors = 0, color_sum = 0, color_squares = 0;
  for (std::size_t v = 0; v < 3; ++v) {
    RangeImage const& image = result.set.views[v].image;
    double last = NAN;
    for (int y = 0; y < image.camera.height(); ++y)
      for (int x = 0; x < image.camera.width(); ++x) {
        double const z = (image.depth(y, x) - result.true_depth[v](y, x)) / sigma;
        if (std::isnan(z)) {
          last = NAN;
          // Far from the outline the background is one colour.
          if (y < 4)
            for (int c = 0; c < 3; ++c) {
              double const e = image.color(y, x)[c] - std::array{128.0, 110.0, 96.0}[c];
              color_sum += e, color_squares += e * e, ++colors;
            }
          continue;
        }
        sum += z, squares += z * z, tails += std::abs(z) > 1.959964, ++n;
        if (!std::isnan(last)) products += z * last, ++pairs;
        last = z;
        EXPECT_FLOAT_EQ(image.sigma(y, x), static_cast<float>(std::hypot(sigma, kSynthDepthFloor * result.radius)));
      }
  }
  ASSERT_GT(n, 50000);
  // Five standard deviations of each estimate: mean 1/√n, χ²/n √(2/n), product 1/√n, share of tails √(pq/n).
  EXPECT_LT(std::abs(sum / n), 5 / std::sqrt(n));
  EXPECT_NEAR(squares / n, 1, 5 * std::sqrt(2 / n));
  EXPECT_LT(std::abs(products / pairs), 5 / std::sqrt(pairs));
  EXPECT_NEAR(tails / n, 0.05, 5 * std::sqrt(0.05 * 0.95 / n));
  ASSERT_GT(colors, 5000);
  double const variance = 9 + 1.0 / 12;  // rounding to whole levels adds its own
  EXPECT_LT(std::abs(color_sum / colors), 5 * std::sqrt(variance / colors));
  EXPECT_NEAR(color_squares / colors, variance, 5 * variance * std::sqrt(2 / colors));
  EXPECT_DOUBLE_EQ(result.set.error_budget.sampling.rms, std::hypot(sigma, kSynthDepthFloor * result.radius));
}

TEST(Scanner, WithoutNoiseDepthIsTheTruthAndSigmaStaysAboveZero) {
  Context context;
  SynthResult const result = synthesize(make_icosphere({0, 0, 0}, 40, 3), small(2), context);
  for (std::size_t v = 0; v < 2; ++v) {
    RangeImage const& image = result.set.views[v].image;
    EXPECT_TRUE(same_bytes(image.depth, result.true_depth[v]));
    for (int y = 0; y < image.camera.height(); ++y)
      for (int x = 0; x < image.camera.width(); ++x)
        if (image.has_depth(x, y)) {
          EXPECT_GT(image.sigma(y, x), 0);
        }
  }
}

TEST(Scanner, DisturbedPosesAreOffByExactlyWhatWasAsked) {
  SynthOptions options = small(6);
  options.disturbance.turn_deg = 3;
  options.disturbance.share = 0.02;
  Context context;
  SynthResult const result = synthesize(make_icosphere({5, 6, 7}, 40, 2), options, context);
  Vector3d const center = result.set.center;
  for (std::size_t v = 0; v < 6; ++v) {
    Isometry3d const motion = *result.set.views[v].object_from_camera * result.true_poses[v].inverse();
    double const turned = Eigen::AngleAxisd(motion.linear()).angle() * 180 / std::numbers::pi;
    double const moved = (motion * center - center).norm();
    EXPECT_NEAR(turned, v == 0 ? 0 : 3, 1e-6) << v;
    EXPECT_NEAR(moved, v == 0 ? 0 : 0.02 * 2 * result.radius, 1e-9) << v;
  }
  Isometry3d const a = *result.set.views[1].object_from_camera * result.true_poses[1].inverse();
  Isometry3d const b = *result.set.views[2].object_from_camera * result.true_poses[2].inverse();
  EXPECT_FALSE(a.isApprox(b, 1e-3)) << "each view has its own error";
}

TEST(Scanner, SameSeedSameBytesForAnyNumberOfThreads) {
  TriangleMesh mesh = make_icosphere({0, 0, 0}, 40, 4);
  for (auto const& v : mesh.vertices)
    mesh.colors.emplace_back(cv::saturate_cast<uchar>(3 * v.x()), 128, cv::saturate_cast<uchar>(-3 * v.y()));
  SynthOptions options = small(3);
  options.noise = {0.001, 2};
  options.disturbance.turn_deg = 1;
  Context one, four, other_seed;
  one.threads = 1;
  four.threads = 4;
  other_seed.seed = 2;
  SynthResult const a = synthesize(mesh, options, one);
  expect_same(a, synthesize(mesh, options, four));
  EXPECT_FALSE(same_bytes(a.set.views[1].image.depth, synthesize(mesh, options, other_seed).set.views[1].image.depth));
}

TEST(Scanner, APointHasTheSameColourFromEverySide) {
  TriangleMesh const mesh = make_icosphere({0, 0, 0}, 40, 4);
  SynthOptions options = small(8);
  options.layout = SynthOptions::Layout::circle;
  Context context;
  SynthResult const result = synthesize(mesh, options, context);
  View const &a = result.set.views[0], &b = result.set.views[1];
  Camera const& camera = a.image.camera;
  int compared = 0;
  for (int y = 4; y < camera.height() - 4; ++y)
    for (int x = 4; x < camera.width() - 4; ++x) {
      if (!a.image.has_depth(x, y)) continue;
      Vector3d const p = *a.object_from_camera * a.image.point(x, y);
      // Well inside both outlines: seen at less than 60°.
      if (p.normalized().dot(a.eye().normalized()) < 0.7 || p.normalized().dot(b.eye().normalized()) < 0.7) continue;
      Eigen::Vector2d const q = camera.project(b.object_from_camera->inverse() * p);
      cv::Vec3b const there = b.image.color(static_cast<int>(std::lround(q.y())), static_cast<int>(std::lround(q.x())));
      for (int c = 0; c < 3; ++c)
        EXPECT_NEAR(a.image.color(y, x)[c], there[c], 4);  // half a pixel of shading, rounding
      ++compared;
    }
  EXPECT_GT(compared, 300);
}

TEST(Scanner, SharpEdgesStaySharpAndFlatFacesFlat) {
  SynthOptions options = small(1);
  options.layout = SynthOptions::Layout::circle;
  options.elevation_deg = 0;
  Context context;
  SynthResult const result = synthesize(make_cube(), options, context);
  RangeImage const& image = result.set.views[0].image;  // the face z = 1 alone
  int const cx = image.camera.width() / 2, cy = image.camera.height() / 2;
  cv::Vec3b const middle = image.color(cy, cx);
  for (int d : {-20, 20})
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(image.color(cy + d, cx)[c], middle[c], 1);
      EXPECT_NEAR(image.color(cy, cx + d)[c], middle[c], 1);
    }
  EXPECT_FLOAT_EQ(result.true_depth[0](cy, cx), static_cast<float>(4 * result.radius - 1));
}

TEST(Scanner, WindingDoesNotMatter) {
  TriangleMesh mesh = make_icosphere({0, 0, 0}, 40, 3);
  Context context;
  SynthResult const outward = synthesize(mesh, small(2), context);
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  SynthResult const inward = synthesize(mesh, small(2), context);
  for (std::size_t v = 0; v < 2; ++v) {
    EXPECT_TRUE(same_bytes(outward.set.views[v].image.classes, inward.set.views[v].image.classes));
    cv::Mat3b const &a = outward.set.views[v].image.color, &b = inward.set.views[v].image.color;
    for (std::size_t i = 0; i < a.total() * 3; ++i) EXPECT_NEAR(a.data[i], b.data[i], 1);
  }
}

TEST(Scanner, AModelWithoutExtentIsRefused) {
  Context context;
  EXPECT_SCANVIEW_ERROR(synthesize({}, {}, context), ErrorCode::bad_input, "no triangles");
  TriangleMesh point;
  point.vertices = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
  point.triangles = {{0, 1, 2}};
  EXPECT_SCANVIEW_ERROR(synthesize(point, {}, context), ErrorCode::bad_input, "no extent");
}

TEST(Scanner, DegenerateTrianglesAndUnusedVerticesAreHarmless) {
  TriangleMesh mesh = make_icosphere({0, 0, 0}, 40, 3);
  Context context;
  SynthResult const clean = synthesize(mesh, small(2), context);
  mesh.vertices.emplace_back(1e6f, 0, 0);  // used by nothing
  mesh.triangles.emplace_back(0, 0, 1);
  mesh.triangles.emplace_back(5, 5, 5);
  expect_same(clean, synthesize(mesh, small(2), context));

  TriangleMesh line;  // extent, but no area
  line.vertices = {{0, 0, 0}, {1, 0, 0}, {2, 0, 0}};
  line.triangles = {{0, 1, 2}};
  EXPECT_EQ(synthesize(line, small(2), context).set.views[0].image.count_depths(), 0u);
}

TEST(Scanner, FromInsideItSeesTheInside) {
  SynthOptions options = small(3);
  options.distance = 0.3;
  Context context;
  SynthResult const result = synthesize(make_icosphere({0, 0, 0}, 40, 3), options, context);
  for (View const& view : result.set.views) {
    EXPECT_EQ(view.image.count_depths(), view.image.depth.total());
    view.image.check();
  }
}

TEST(Scanner, NoiseThatCarriesADepthBehindTheCameraLeavesAHole) {
  SynthOptions options = small(1);
  options.distance = 0.9;
  options.noise.depth_sigma = 1;
  Context context;
  RangeImage const image = synthesize(make_icosphere({0, 0, 0}, 40, 3), options, context).set.views[0].image;
  image.check();
  EXPECT_LT(image.count_depths(), image.depth.total());
}

TEST(Scanner, OnePixelIsAPicture) {
  SynthOptions options = small(1);
  options.width = options.height = 1;
  Context context;
  EXPECT_EQ(synthesize(make_cube(), options, context).set.views[0].image.count_depths(), 1u);
}

TEST(Scanner, BadOptionsAreNamed) {
  Context context;
  auto const refused = [&](auto&& change, char const* field) {
    SynthOptions options;
    change(options);
    EXPECT_SCANVIEW_ERROR(synthesize(make_cube(), options, context), ErrorCode::usage, field);
  };
  refused([](auto& o) { o.views = 0; }, "views");
  refused([](auto& o) { o.width = -1; }, "width");
  refused([](auto& o) { o.height = 1 << 20; }, "height");
  refused([](auto& o) { o.elevation_deg = 91; }, "elevation_deg");
  refused([](auto& o) { o.distance = 0; }, "distance");
  refused([](auto& o) { o.distance = NAN; }, "distance");
  refused([](auto& o) { o.disturbance.turn_deg = -1; }, "disturbance.turn_deg");
  refused([](auto& o) { o.disturbance.share = INFINITY; }, "disturbance.share");
  refused([](auto& o) { o.noise.depth_sigma = -0.1; }, "noise.depth_sigma");
  refused([](auto& o) { o.noise.color_sigma = NAN; }, "noise.color_sigma");
}

TEST(Scanner, ARealModelWoundInwardsIsSeenWhole) {
  auto const path = std::filesystem::path(SCANVIEW_SOURCE_DIR) / "../shared/data/models/horse.ply";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no data set models/horse.ply";
  Context context;
  SynthResult const result = synthesize(read_triangle_mesh(path), small(3), context);
  for (View const& view : result.set.views) {
    double const share = static_cast<double>(view.image.count_depths()) / static_cast<double>(view.image.depth.total());
    EXPECT_GT(share, 0.08);
    double brightness = 0;
    for (int y = 0; y < view.image.camera.height(); ++y)
      for (int x = 0; x < view.image.camera.width(); ++x)
        if (view.image.has_depth(x, y)) brightness += view.image.color(y, x)[1];
    EXPECT_GT(brightness / static_cast<double>(view.image.count_depths()), 60) << "lit from outside, not from inside";
  }
}

}  // namespace
}  // namespace scanview
