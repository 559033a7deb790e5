#include <gtest/gtest.h>
#include <tbb/global_control.h>

#include <cmath>
#include <cstring>
#include <numbers>

#include "base/random.h"
#include "viewer/raster/id_buffer.h"
#include "viewer/raster/kernels.h"
#include "viewer/raster_reference.h"
#include "viewer/scene.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
namespace {

using namespace test;
using Eigen::Isometry3d;
using Eigen::Vector3d;

bool same_bytes(cv::Mat const& a, cv::Mat const& b) {
  return a.size() == b.size() && a.type() == b.type() && a.isContinuous() && b.isContinuous() &&
         std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

Isometry3d const kBefore = look_at({0.3, 0.4, 3.2}, {0, 0, 0});

TEST(IdBuffer, RandomTrianglesAgreeWithExactArithmetic) {
  for (std::uint64_t const seed : {1U, 2U, 3U}) {
    SCOPED_TRACE(seed);
    for (double const size : {0.01, 0.1, 0.6}) {
      auto const mesh = random_triangles(200, size, seed);
      for (auto const culling : {Culling::none, Culling::back_faces}) {
        expect_exact(mesh, Camera::perspective(203, 151, 200, 180, 101.3, 75.2), Isometry3d::Identity(), culling);
        expect_exact(mesh, Camera::orthographic(203, 151, 0.015, 0.015, 101.3, 75.2), Isometry3d::Identity(), culling);
      }
    }
  }
}

TEST(IdBuffer, ASphereAgreesWithExactArithmeticAndWithRays) {
  auto const mesh = sphere_mesh(24, 14);
  Camera const camera = Camera::perspective(181, 143, 170, 170, 90, 71);
  for (auto const culling : {Culling::none, Culling::back_faces}) {
    expect_exact(mesh, camera, kBefore, culling);
    EXPECT_GT(expect_as_cast(mesh, camera.resized(90, 71), kBefore, culling), 5000);
  }
  // What faces the camera hides what does not: both draw the same.
  auto const all = draw_id_buffer(mesh, camera, kBefore, Culling::none);
  auto const facing = draw_id_buffer(mesh, camera, kBefore, Culling::back_faces);
  int different = 0;
  for (int y = 0; y < all.id.rows; ++y) {
    for (int x = 0; x < all.id.cols; ++x) different += all.id(y, x) != facing.id(y, x);
  }
  EXPECT_LE(different, 3);  // on the outline, where depths are equal
}

TEST(IdBuffer, BackFacesAreCulledOrNot) {
  // From inside all faces are back faces.
  auto const mesh = sphere_mesh(20, 10);
  Camera const camera = Camera::perspective(40, 30, 20, 20, 20, 15);
  Isometry3d const inside = look_at({0, 0, 0}, {0, 0, 1});
  auto const culled = draw_id_buffer(mesh, camera, inside, Culling::back_faces);
  auto const all = draw_id_buffer(mesh, camera, inside, Culling::none);
  EXPECT_EQ(cv::countNonZero(culled.id == kNoTriangle), 40 * 30);
  EXPECT_EQ(cv::countNonZero(all.id == kNoTriangle), 0);
}

TEST(IdBuffer, SliversAreDrawnExactlyAndStayBetweenTheirCorners) {
  // A fan of 400 triangles about a corner, some thinner than 1/256 pixel; depths far apart.
  CounterRandom random(5, 0);
  TriangleMesh mesh;
  mesh.vertices.emplace_back(-0.9F, -0.7F, 3.0F);
  for (int i = 0; i <= 400; ++i) {
    double const a = 0.5 * std::numbers::pi * (i + 0.4 * between(random, -1, 1)) / 400;
    mesh.vertices.push_back(
        Vector3d(-0.9 + 1.7 * std::cos(a), -0.7 + 1.4 * std::sin(a), i % 2 == 0 ? 2.5 : 4).cast<float>());
    if (i > 0) mesh.triangles.emplace_back(0, i, i + 1);
  }
  Camera const camera = Camera::perspective(300, 260, 330, 330, 150, 130);
  // Coverage exactly; depths within a hundredth: their slopes are steep.
  expect_exact(mesh, camera, Isometry3d::Identity(), Culling::none, 0.01);
  auto const drawn = draw_id_buffer(mesh, camera, Isometry3d::Identity());
  for (auto const depth : drawn.depth) {
    if (std::isnan(depth)) continue;
    ASSERT_GT(depth, 2.5 - 1e-3);
    ASSERT_LT(depth, 4 + 1e-3);
  }
}

TEST(IdBuffer, TrianglesOfNoWidthStayBetweenTheirCorners) {
  // Needles a few 1/256 pixel wide across the whole picture: their slopes are beyond single precision.
  CounterRandom random(6, 0);
  Camera const camera = Camera::perspective(1000, 700, 900, 900, 500, 350);
  TriangleMesh mesh;
  for (int i = 0; i < 3000; ++i) {
    auto const far_off = [&] { return Vector3d(between(random, -1.6, 1.6), between(random, -1.1, 1.1), 3); };
    Vector3d const a = far_off(), b = far_off();
    Vector3d const c = a + between(random, 0.2, 0.8) * (b - a) + 1e-5 * Vector3d(random.normal(), random.normal(), 0);
    int const n = int(mesh.vertices.size());
    mesh.vertices.push_back(a.cast<float>());
    mesh.vertices.push_back(b.cast<float>());
    mesh.vertices.push_back((c * (4.0 / 3)).cast<float>());  // the same place on the screen, at depth 4
    mesh.triangles.emplace_back(n, n + 1, n + 2);
  }
  auto const drawn = draw_id_buffer(mesh, camera, Isometry3d::Identity());
  int count = 0, outside = 0;
  for (auto const depth : drawn.depth) {
    if (std::isnan(depth)) continue;
    ++count;
    outside += !(depth > 3 - 1e-3 && depth < 4 + 1e-3);
  }
  EXPECT_GT(count, 500);
  EXPECT_EQ(outside, 0);
}

TEST(IdBuffer, AGridOnPixelCentresCoversEveryPixelOnce) {
  // All corners and edges lie exactly on pixel centres: left and top ones own them.
  constexpr int kColumns = 9, kRows = 7;
  for (int const spacing : {1, 2, 3}) {
    auto const mesh = grid(kColumns, kRows, [&](int x, int y) { return Vector3d(spacing * x, spacing * y, 2); });
    Camera const camera = Camera::orthographic(36, 30, 1, 1, 4, 3);
    auto const count = ownership(mesh, camera);
    auto const drawn = draw_id_buffer(mesh, camera, Isometry3d::Identity());
    for (int y = 0; y < 30; ++y) {
      for (int x = 0; x < 36; ++x) {
        bool const inside = x >= 4 && x < 4 + spacing * kColumns && y >= 3 && y < 3 + spacing * kRows;
        ASSERT_EQ(count(y, x), inside ? 1 : 0) << x << ' ' << y;
        ASSERT_EQ(drawn.id(y, x) != kNoTriangle, inside) << x << ' ' << y;
        int const square = (y - 3) / spacing * kColumns + (x - 4) / spacing;
        if (inside) {
          ASSERT_EQ(drawn.id(y, x) / 2, square);
        }
      }
    }
  }
}

TEST(IdBuffer, SharedEdgesOwnEveryPixelOnce) {
  // A grid with shaken corners, in perspective, larger than the picture: some corners on pixel centres, some anywhere.
  for (std::uint64_t const seed : {1U, 2U}) {
    CounterRandom random(seed, 1);
    auto const mesh = grid(12, 10, [&](int x, int y) {
      double const shake = (x + y) % 3 == 0 ? 0 : 0.35;
      double const u = 7 * x - 5 + 7 * shake * between(random, -1, 1),
                   v = 7 * y - 5 + 7 * shake * between(random, -1, 1);
      double const z = 2 + 0.5 * between(random, -1, 1);
      return Vector3d((u - 32) / 64 * z, (v - 24) / 64 * z, z);
    });
    auto const count = ownership(mesh, Camera::perspective(64, 48, 64, 64, 32, 24));
    for (auto const n : count) ASSERT_EQ(n, 1);
  }
}

TEST(IdBuffer, OfEqualDepthsTheFirstWins) {
  tbb::global_control const allow(tbb::global_control::max_allowed_parallelism, 8);
  // Stacks of the same triangle, also across the parts of 8192 that threads share out, and one that must be clipped.
  TriangleMesh mesh;
  mesh.vertices = {{-1, -1, 2}, {3, -1, 2}, {-1, 3, 2}, {-4e3F, -4e3F, 2}, {8e3F, -4e3F, 2}, {-4e3F, 8e3F, 2}};
  Camera const camera = Camera::perspective(50, 40, 30, 30, 25, 20);
  for (bool const clipped_first : {false, true}) {
    mesh.triangles.clear();
    mesh.triangles.emplace_back(clipped_first ? Eigen::Vector3i(3, 5, 4) : Eigen::Vector3i(0, 2, 1));
    for (int i = 0; i < 20000; ++i) mesh.triangles.emplace_back(0, 2, 1);
    mesh.triangles.emplace_back(clipped_first ? Eigen::Vector3i(0, 2, 1) : Eigen::Vector3i(3, 5, 4));
    for (int const threads : {1, 2, 8}) {
      auto const drawn = draw_id_buffer(mesh, camera, Isometry3d::Identity(), Culling::none, threads);
      EXPECT_EQ(drawn.id(20, 25), 0);
      for (auto const id : drawn.id) ASSERT_TRUE(id == 0 || id == (clipped_first ? 0 : 20001));
    }
  }
}

TEST(IdBuffer, ATriangleThroughTheNearPlaneIsCut) {
  // A floor from behind the eye to far ahead, and a wall.
  TriangleMesh mesh;
  mesh.vertices = {{-3, 1, -5}, {3, 1, -5}, {0, 1, 40}, {-20, -9, 25}, {20, -9, 25}, {0, 30, 25}};
  mesh.triangles = {{0, 1, 2}, {3, 5, 4}};
  Camera const camera = Camera::perspective(64, 60, 40, 40, 31.2, 20.7);
  for (auto const culling : {Culling::none, Culling::back_faces}) {
    // The far end of the bounds is at 40, so the near plane at a ten-thousandth of it: above what a ray can hit here.
    EXPECT_GT(expect_as_cast(mesh, camera, Isometry3d::Identity(), culling, 0.02, 4e-3), 3000);
  }
  auto const drawn = draw_id_buffer(mesh, camera, Isometry3d::Identity());
  EXPECT_GT(cv::countNonZero(drawn.id == 0), 200);
  // All of it behind: nothing.
  auto const away = draw_id_buffer(mesh, camera, look_at({0, 0, 50}, {0, 0, 60}));
  EXPECT_EQ(cv::countNonZero(away.id != kNoTriangle), 0);
}

TEST(IdBuffer, TrianglesThroughTheNearPlaneShareTheirEdges) {
  // From within a shaken floor: every pixel below the horizon exactly once.
  CounterRandom random(8, 0);
  auto const mesh = grid(7, 9, [&](int x, int y) {
    return Vector3d(4 * x - 14 + between(random, -1, 1), 1, 5 * y - 18 + between(random, -1, 1));
  });
  auto const count = ownership(mesh, Camera::perspective(60, 50, 30, 30, 30, -6));
  for (int y = 0; y < count.rows; ++y) {
    for (int x = 10; x < 50; ++x) ASSERT_EQ(count(y, x), y > 6 - 1 ? 1 : count(y, x)) << x << ' ' << y;
  }
}

TEST(IdBuffer, ATriangleMayBeAMillionPixelsLarge) {
  // Zoomed until a single triangle covers the window.
  TriangleMesh mesh;
  mesh.vertices = {{-1, -0.8F, 2.0F}, {1.1F, -0.9F, 2.2F}, {0.1F, 1.2F, 1.9F}, {1.9F, 1.3F, 2.1F}};
  mesh.triangles = {{0, 2, 1}, {1, 2, 3}};
  for (double const zoom : {1e3, 1e5, 2e6, 1e8}) {
    SCOPED_TRACE(zoom);
    Camera const camera = Camera::perspective(61, 47, zoom, zoom, 30 - 0.01 * zoom, 23 - 0.02 * zoom);
    auto const drawn = draw_id_buffer(mesh, camera, Isometry3d::Identity());
    for (int y = 0; y < 47; y += 5) {
      for (int x = 0; x < 61; x += 5) {
        ASSERT_EQ(drawn.id(y, x), 0);
        auto const truth = cast(mesh, camera, Isometry3d::Identity(), x, y, Culling::none);
        ASSERT_NEAR(drawn.depth(y, x), truth.second, 1e-5);
      }
    }
    // And on the edge that two of them share.
    Vector3d const middle = 0.5 * (mesh.vertices[1] + mesh.vertices[2]).cast<double>();
    Camera const at_edge = Camera::perspective(61, 47, zoom, zoom, 30 - zoom * middle.x() / middle.z(),
                                               23 - zoom * middle.y() / middle.z());
    auto const count = ownership(mesh, at_edge);
    for (auto const n : count) ASSERT_EQ(n, 1);
    auto const both = draw_id_buffer(mesh, at_edge, Isometry3d::Identity());
    EXPECT_GT(cv::countNonZero(both.id == 0), 1000);
    EXPECT_GT(cv::countNonZero(both.id == 1), 1000);
  }
}

TEST(IdBuffer, NeighboursOfClippedTrianglesShareTheirEdges) {
  // Triangles within the guard band beside ones that reach far out of it: the shared corners are at the same place in
  // both. Long edges, so that a corner off by 1/256 pixel would show.
  int tried = 0;
  for (std::uint64_t seed = 0; tried < 40; ++seed) {
    CounterRandom random(seed, 2);
    Camera const camera = Camera::perspective(1200, 900, 1000, 1000, 600, 450);
    auto const at = [&](double u, double v, double z) {
      return Eigen::Vector3f(((u - 600) / 1000 * z), ((v - 450) / 1000 * z), z);
    };
    TriangleMesh mesh;
    auto const z = [&] { return between(random, 1, 3); };
    mesh.vertices = {Eigen::Vector3f(at(-200 + between(random, -50, 50), 300 * between(random, 0, 1), z())),
                     Eigen::Vector3f(at(1400 + between(random, -50, 50), 600 + 300 * between(random, 0, 1), z())),
                     Eigen::Vector3f(at(600, -1200, z())), Eigen::Vector3f(at(600, 90000, z()))};
    mesh.triangles = {{0, 1, 2}, {1, 0, 3}};
    // Only where single and double precision round to different places.
    auto const vertices = snapped(mesh, camera, Isometry3d::Identity());
    bool differ = false;
    for (std::size_t i = 0; i < 2; ++i) {
      Eigen::Vector2d const exact = 256 * camera.project(mesh.vertices[i].cast<double>());
      differ = differ || std::lround(exact.y()) != vertices[i].y;
    }
    if (!differ) continue;
    ++tried;
    auto const count = ownership(mesh, camera);
    int wrong = 0;
    for (int y = 0; y < count.rows; ++y) {
      for (int x = 150; x < 1000; ++x) wrong += count(y, x) != 1;
    }
    EXPECT_EQ(wrong, 0) << seed;
  }
}

TEST(IdBuffer, OnePixelIsAPicture) {
  auto const mesh = sphere_mesh(12, 8);
  Camera const camera = Camera::perspective(1, 1, 2, 2, 0.1, -0.2);
  auto const drawn = draw_id_buffer(mesh, camera, kBefore, Culling::back_faces);
  auto const truth = cast(mesh, camera, kBefore, 0, 0, Culling::back_faces);
  EXPECT_EQ(drawn.id(0, 0), truth.first);
  EXPECT_NEAR(drawn.depth(0, 0), truth.second, 0.02);
  TriangleMesh const nothing;
  EXPECT_EQ(draw_id_buffer(nothing, camera, kBefore).id(0, 0), kNoTriangle);
}

TEST(IdBuffer, LargePicturesHaveNoSeams) {
  // 8000 x 6000: four blocks; the seams are at 4096.
  auto const mesh = sphere_mesh(300, 200);
  Camera const camera = Camera::perspective(8000, 6000, 11000, 11000, 4000, 3200);
  Isometry3d const pose = look_at({0, 0, 4}, {0, 0, 0});
  auto const whole = draw_id_buffer(mesh, camera, pose, Culling::back_faces);
  for (cv::Rect const& around : {cv::Rect(4046, 3900, 100, 400), cv::Rect(3000, 4046, 1200, 100)}) {
    auto const part = draw_id_buffer(mesh, camera.cropped(around.x, around.y, around.width, around.height), pose,
                                     Culling::back_faces);
    int different = 0, drawn = 0;
    for (int y = 0; y < around.height; ++y) {
      for (int x = 0; x < around.width; ++x) {
        int const id = whole.id(around.y + y, around.x + x);
        ASSERT_NE(id, kNoTriangle);
        ASSERT_NE(part.id(y, x), kNoTriangle);
        ++drawn;
        different += id != part.id(y, x);
        ASSERT_NEAR(whole.depth(around.y + y, around.x + x), part.depth(y, x), 1e-4);
      }
    }
    // Vertices in other blocks are rounded to 1/256 pixel from other single precision numbers.
    EXPECT_LT(different, 0.002 * drawn);
  }
}

TEST(IdBuffer, OrthographicDepthsMayBeNegative) {
  auto const mesh = sphere_mesh(24, 14);
  Camera const camera = Camera::orthographic(90, 80, 0.03, 0.025, 44.3, 40.1);
  for (double const distance : {-9.0, 0.0, 9.0}) {
    Isometry3d const pose = look_at({0, 0, distance}, {0, 0, distance - 1});
    for (auto const culling : {Culling::none, Culling::back_faces}) expect_exact(mesh, camera, pose, culling);
    auto const drawn = draw_id_buffer(mesh, camera, pose);
    EXPECT_NEAR(drawn.depth(40, 44), distance - 1, 0.02);
    EXPECT_GT(expect_as_cast(mesh, camera.resized(45, 40), pose, Culling::none), 1500);
  }
}

/// A set of textured views, and a frame of it from between them.
Scene textured() {
  Camera const camera = Camera::perspective(160, 120, 150, 155, 83.25, 56.5);
  std::vector<Isometry3d> poses;
  for (auto const& eye : {Vector3d(0, 0, 4), Vector3d(3, 1, 2.5), Vector3d(-2, 2, 3), Vector3d(0.5, -3, 3)})
    poses.push_back(look_at(eye, Vector3d::Zero()));
  return scan(sphere(Vector3d::Zero(), 1), camera, poses, 0.3, 0.02);
}

std::vector<Frame> frames(int threads) {
  static auto const library = [] {
    auto const scene = textured();
    return std::make_shared<ViewLibrary>(scene.set, scene.meshes);
  }();
  std::vector<Frame> result;
  for (bool const wireframe : {false, true}) {
    ViewBasedOptions options;
    options.wireframe = wireframe;
    auto const renderer = make_cpu_renderer(library, options, threads);
    for (auto const& eye : {Vector3d(0.4, 0.3, 3), Vector3d(2, 1, 12), Vector3d(0.1, 0.2, 1.3)}) {
      result.push_back(
          renderer->render(Camera::perspective(157, 131, 140, 140, 80, 66), look_at(eye, Vector3d::Zero())));
    }
    result.push_back(
        renderer->render(Camera::orthographic(157, 131, 0.02, 0.02, 80, 66), look_at({1, 1, 3}, {0, 0, 0})));
  }
  return result;
}

void expect_same(std::vector<Frame> const& a, std::vector<Frame> const& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    EXPECT_TRUE(same_bytes(a[i].color, b[i].color)) << i;
    EXPECT_TRUE(same_bytes(a[i].depth, b[i].depth)) << i;
  }
}

TEST(CpuFrames, LargePicturesHaveNoSeams) {
  // Two blocks beside each other, and one above the other, against what is drawn in one.
  auto const scene = textured();
  auto const renderer = make_cpu_renderer(std::make_shared<ViewLibrary>(scene.set, scene.meshes));
  Isometry3d const pose = look_at({0.4, 0.3, 3}, {0, 0, 0});
  struct Case {
    Camera camera;
    cv::Rect around;
  };
  for (Case const& one : {Case{Camera::perspective(4200, 90, 150, 150, 4100, 45), cv::Rect(4046, 0, 120, 90)},
                          Case{Camera::perspective(90, 4200, 150, 150, 45, 4090), cv::Rect(0, 4046, 90, 120)}}) {
    auto const whole = renderer->render(one.camera, pose);
    cv::Rect const& r = one.around;
    auto const part = renderer->render(one.camera.cropped(r.x, r.y, r.width, r.height), pose);
    int drawn = 0, different = 0;
    for (int y = 0; y < r.height; ++y) {
      for (int x = 0; x < r.width; ++x) {
        auto const& pixel = part.color(y, x);
        drawn += pixel[3] != 0;
        different += greatest_difference(whole.color(r.y + y, r.x + x), pixel) > 4;
      }
    }
    EXPECT_GT(drawn, 5000);
    EXPECT_LT(different, 10);  // of the outline, rounded to 1/256 pixel from other single precision numbers
  }
}

struct AllTargets {
  ~AllTargets() { use_kernel_target(""); }
};

TEST(Kernels, AllInstructionSetsGiveTheSameBytes) {
  AllTargets const restore;
  auto const mesh = random_triangles(500, 0.3, 9);
  Camera const camera = Camera::perspective(333, 217, 300, 300, 160, 110);
  auto const ids = draw_id_buffer(mesh, camera, Isometry3d::Identity());
  auto const pictures = frames(0);
  EXPECT_GT(drawn_pixels(pictures[0].color), 2000U);
  ASSERT_FALSE(kernel_targets().empty());
  for (auto const* const target : kernel_targets()) {
    SCOPED_TRACE(target);
    use_kernel_target(target);
    auto const others = draw_id_buffer(mesh, camera, Isometry3d::Identity());
    EXPECT_TRUE(same_bytes(ids.id, others.id));
    EXPECT_TRUE(same_bytes(ids.depth, others.depth));
    expect_same(pictures, frames(0));
    use_kernel_target("");
  }
}

TEST(Kernels, AnyNumberOfThreadsGivesTheSameBytes) {
  tbb::global_control const allow(tbb::global_control::max_allowed_parallelism, 8);
  auto const mesh = sphere_mesh(200, 150);
  Camera const camera = Camera::perspective(333, 217, 300, 300, 160, 110);
  auto const ids = draw_id_buffer(mesh, camera, kBefore, Culling::none, 1);
  auto const pictures = frames(1);
  for (int const threads : {2, 3, 8}) {
    SCOPED_TRACE(threads);
    auto const others = draw_id_buffer(mesh, camera, kBefore, Culling::none, threads);
    EXPECT_TRUE(same_bytes(ids.id, others.id));
    EXPECT_TRUE(same_bytes(ids.depth, others.depth));
    expect_same(pictures, frames(threads));
  }
}

}  // namespace
}  // namespace scanview
