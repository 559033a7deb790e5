#include "viewer/visibility/visibility_field.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"
#include "expect_error.h"
#include "synth/visible_triangles.h"
#include "viewer/raster/id_buffer.h"
#include "viewer/raster/kernels.h"
#include "viewer/visibility/hidden_cells.h"
#include "viewer/visibility/smallest_samples.h"
#include "viewer/visibility/visibility_check.h"
#include "viewer/visibility/visibility_file.h"
#include "visibility_models.h"

namespace scanview {
namespace {

using test::kInfinity;
using test::quick;
using test::selected;

void expect_ordered(std::span<IndexRange const> ranges, std::size_t triangles) {
  std::size_t end = 0;
  for (std::size_t k = 0; k < ranges.size(); ++k) {
    EXPECT_GT(ranges[k].count, 0U);
    EXPECT_TRUE(k == 0 || ranges[k].first > end) << "ranges that touch are one";
    end = ranges[k].first + ranges[k].count;
  }
  EXPECT_LE(end, triangles);
}

TEST(TriangleSampler, SeesTheTrianglesOfTheIdPicture) {
  TriangleMesh const mesh = test::body().mesh;
  std::vector<std::uint32_t> labels(mesh.triangles.size());
  for (std::uint32_t i = 0; i < labels.size(); ++i) labels[i] = i;
  RasterMesh const raster = raster_mesh(mesh, labels);
  Eigen::AlignedBox3d bounds;
  for (auto const& v : mesh.vertices) bounds.extend(v.cast<double>());
  TrianglePlanes const planes(mesh, bounds.center(), bounds.diagonal().norm() / 2);
  TriangleSampler sampler(raster, planes, bounds);
  for (double const distance : {1.5, 4.0, kInfinity}) {
    // The last is drawn in tiles.
    for (int const size : {100, 333, 1100}) {
      SampleCamera const camera = ball_camera(bounds.center(), planes.radius, {0.3, -0.5, 0.8}, distance, size);
      SeenTriangles const in_picture = sampler.sample(camera, Seen::in_picture);
      IdBuffer const reference = draw_id_buffer(mesh, camera.camera, camera.object_from_camera);
      int differences = 0, shown = 0;
      std::vector<bool> in_reference(mesh.triangles.size());
      for (std::int32_t const id : reference.id) {
        if (id == kNoTriangle) continue;
        ++shown;
        in_reference[static_cast<std::size_t>(id)] = true;
      }
      int here = 0;
      sampler.for_each_pixel([&](int x, int y, std::uint32_t id) {
        ++here;
        if (reference.id(y, x) != static_cast<std::int32_t>(id)) ++differences;
      });
      EXPECT_EQ(here, shown);
      // Of equal depths the first stays; here fronts come first.
      EXPECT_LE(differences, shown / 1000);
      SeenTriangles const nearly = sampler.sample(camera, Seen::nearly);
      for (std::size_t w = 0; w < nearly.front.size(); ++w) {
        EXPECT_EQ(in_picture.front[w] & ~nearly.front[w], 0U);
        EXPECT_EQ(in_picture.back[w], 0U) << "closed bodies show no backs";
      }
    }
  }
}

TEST(TriangleSampler, AllInstructionSetsSeeTheSame) {
  struct AllTargets {
    ~AllTargets() { use_kernel_target(""); }
  } const restore;
  PolygonModel const model = test::body();
  Context context;
  VisibilityOptions options = quick();
  options.samples = 18;
  options.widening = 0.3;
  BitRows const expected = build_visibility(model, options, context).rows;
  for (char const* const target : kernel_targets()) {
    use_kernel_target(target);
    EXPECT_TRUE(build_visibility(model, options, context).rows == expected) << target;
  }
}

TEST(TriangleSampler, CoplanarDuplicatesBothKeepTheirBit) {
  PolygonModel model;
  test::add_rectangle(model.mesh, {0, 0, 0}, {1, 0, 0}, {0, 1, 0}, 2);
  std::size_t const n = model.mesh.triangles.size();
  for (std::size_t i = 0; i < n; ++i) model.mesh.triangles.push_back(model.mesh.triangles[i]);
  Context context;
  VisibilityOptions options = quick();
  options.method = VisibilityMethod::id;
  VisibilityField const field = build_visibility(model, options, context);
  VisibilitySelector selector(field, drawn_mesh(model.mesh, field.patches));
  auto const is_drawn = selected(field, selector.select({0.5, 0.4, 3}));
  for (bool const drawn : is_drawn) EXPECT_TRUE(drawn);
}

TEST(TriangleSampler, TrianglesBelowAPixelAreNearlySeen) {
  PolygonModel model;
  test::add_sphere(model.mesh, {0, 0, 0}, 1, 6);  // 32768 triangles in pictures of 64 x 64
  Context context;
  VisibilityOptions options = quick();
  options.samples = 66;
  options.resolution = 64;
  options.method = VisibilityMethod::id;
  options.opposite = false;
  VisibilityField const field = build_visibility(model, options, context);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  auto const eyes = unseen_eyes(field, 5, 2, 5, 3);
  EXPECT_EQ(check_visibility(field, drawn, {}, true, eyes, 1024, context).wrong_pixels, 0U);
  options.seen = Seen::in_picture;
  VisibilityField const pictures = build_visibility(model, options, context);
  EXPECT_GT(
      check_visibility(pictures, drawn_mesh(model.mesh, pictures.patches), {}, true, eyes, 1024, context).wrong_pixels,
      1000U);
}

TEST(TriangleSampler, MoreThanTwoToTheTwentyFourTriangles) {
  constexpr std::size_t kCount = (std::size_t{1} << 24) + 5;
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  mesh.triangles.assign(kCount, {0, 0, 0});
  mesh.triangles.back() = {0, 1, 2};
  RasterMesh const raster = raster_mesh(mesh, {});
  TrianglePlanes const planes(mesh, {0.3, 0.3, 0}, 1);
  TriangleSampler sampler(raster, planes, Eigen::AlignedBox3d(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 0)));
  sampler.sample(ball_camera({0.3, 0.3, 0}, 1, {0, 0, 1}, 3, 64), Seen::in_picture);
  std::size_t pixels = 0;
  sampler.for_each_pixel([&](int, int, std::uint32_t id) {
    ++pixels;
    ASSERT_EQ(id, kCount - 1);
  });
  EXPECT_GT(pixels, 100U);
}

TEST(Visibility, WhatRaysSeeIsSelectedAndFacesTheEye) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityField const field = build_visibility(model, quick(), context);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  VisibilitySelector selector(field, drawn);
  RayScene const scene(model.mesh.vertices, model.mesh.triangles);
  std::size_t missed = 0, seen = 0, chosen = 0;
  for (auto const& eye : unseen_eyes(field, 20, 2, 5, 11)) {
    auto const ranges = selector.select(eye);
    expect_ordered(ranges, drawn.triangles.size());
    auto const is_drawn = selected(field, ranges);
    auto const visible = visible_triangles(scene, model.mesh.vertices, model.mesh.triangles, eye, 12, context);
    for (std::size_t i = 0; i < visible.size(); ++i) {
      chosen += is_drawn[i] ? 1U : 0U;
      seen += visible[i] ? 1U : 0U;
      missed += visible[i] && !is_drawn[i] ? 1U : 0U;
    }
    for (std::size_t p = 0; p < is_drawn.size(); ++p) {
      if (!is_drawn[p]) continue;
      auto const corner = [&](int k) {
        return model.mesh.vertices[static_cast<std::size_t>(model.mesh.triangles[p][k])].cast<double>().eval();
      };
      Eigen::Vector3d const normal = (corner(1) - corner(0)).cross(corner(2) - corner(0));
      EXPECT_GE(normal.normalized().dot((eye - corner(0)).normalized()), -1e-5);
    }
  }
  EXPECT_LE(missed, seen / 1000);
  EXPECT_LT(chosen, 2 * seen);
}

TEST(Visibility, NoPixelIsWrongFromUnseenEyes) {
  PolygonModel const model = test::body();
  Context context;
  for (VisibilityMethod const method : {VisibilityMethod::id, VisibilityMethod::patch}) {
    VisibilityOptions options = quick();
    options.method = method;
    options.samples = 1026;
    VisibilityField const field = build_visibility(model, options, context);
    TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
    auto const figures = check_visibility(field, drawn, {}, true, unseen_eyes(field, 50, 2, 5, 2), 512, context);
    EXPECT_LE(static_cast<double>(figures.wrong_pixels), 1e-5 * static_cast<double>(figures.pixels));
    EXPECT_GT(figures.culling_rate, 0.8 * (1 - figures.visible));
  }
}

TEST(Visibility, TheResultDoesNotDependOnThreads) {
  PolygonModel const model = test::body();
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  VisibilityField const a = build_visibility(model, quick(), one), b = build_visibility(model, quick(), two);
  EXPECT_EQ(format_visibility(a, model.mesh), format_visibility(b, model.mesh));
}

TEST(Visibility, NearerThanTheSamplesEverythingIsDrawn) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityField const field = build_visibility(model, quick(), context);
  VisibilitySelector selector(field, drawn_mesh(model.mesh, field.patches));
  std::vector<Eigen::Vector3d> const eyes{field.center + 1.99 * field.radius * Eigen::Vector3d::UnitX(), field.center,
                                          Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())};
  for (Eigen::Vector3d const& eye : eyes) {
    auto const ranges = selector.select(eye);
    EXPECT_TRUE(selector.is_whole());
    ASSERT_EQ(ranges.size(), 1U);
    EXPECT_EQ(ranges[0], (IndexRange{0, static_cast<std::uint32_t>(model.mesh.triangles.size())}));
  }
  selector.select(field.center + 2.01 * field.radius * Eigen::Vector3d::UnitX());
  EXPECT_FALSE(selector.is_whole());
}

TEST(Visibility, FromAfarSelectsWhatFacesTheDirection) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityField const field = build_visibility(model, quick(), context);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  VisibilitySelector selector(field, drawn);
  for (Eigen::Vector3d const& direction : {Eigen::Vector3d(0.2, 0.5, 1), Eigen::Vector3d(-1, 0.1, 0.3)}) {
    auto const ranges = selector.select_from_afar(direction);
    EXPECT_FALSE(selector.is_whole());
    EXPECT_LT(selector.triangles(), 0.6 * static_cast<double>(drawn.triangles.size()));
    EXPECT_LE(missed_pixels(drawn, ranges, ball_camera(field.center, field.radius, direction, kInfinity, 512)).count,
              2U);
  }
}

TEST(Visibility, InsideOutModelsShowTheirBacks) {
  PolygonModel model = test::body();
  Context context;
  VisibilityField const front = build_visibility(model, quick(), context);
  for (auto& triangle : model.mesh.triangles) std::swap(triangle[1], triangle[2]);
  VisibilityField const back = build_visibility(model, quick(), context);
  TriangleMesh const drawn = drawn_mesh(model.mesh, back.patches);
  auto const eyes = unseen_eyes(back, 20, 2, 5, 2);
  auto const figures = check_visibility(back, drawn, {}, true, eyes, 512, context);
  EXPECT_LE(static_cast<double>(figures.wrong_pixels), 1e-5 * static_cast<double>(figures.pixels));
  EXPECT_GT(figures.culling_rate, 0.4);
}

TEST(Visibility, OneTriangleIsSeenFromBothSides) {
  PolygonModel model;
  model.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  model.mesh.triangles = {{0, 1, 2}};
  Context context;
  VisibilityField const field = build_visibility(model, quick(), context);
  VisibilitySelector selector(field, drawn_mesh(model.mesh, field.patches));
  EXPECT_EQ(selector.select({0.3, 0.3, 3}).size(), 1U);
  EXPECT_EQ(selector.select({0.3, 0.3, -3}).size(), 1U);
}

TEST(Visibility, ModelsWithoutExtentAreRefused) {
  PolygonModel model;
  Context context;
  EXPECT_SCANVIEW_ERROR(build_visibility(model, quick(), context), ErrorCode::usage, "extent");
  model.mesh.vertices = {{1, 1, 1}};
  model.mesh.triangles = {{0, 0, 0}};
  EXPECT_SCANVIEW_ERROR(build_visibility(model, quick(), context), ErrorCode::usage, "extent");
}

TEST(Visibility, TransparentPolygonsAreAlwaysDrawnAndHideNothing) {
  PolygonModel model;
  test::add_sphere(model.mesh, {0, 0, 0}, 0.5F, 3);
  std::size_t const inner = model.mesh.triangles.size();
  test::add_sphere(model.mesh, {0, 0, 0}, 1, 3);  // of glass
  model.transparent.assign(model.mesh.triangles.size(), 0);
  std::fill(model.transparent.begin() + static_cast<std::ptrdiff_t>(inner), model.transparent.end(), std::uint8_t{1});
  Context context;
  for (bool const conservative : {false, true}) {
    VisibilityOptions options = quick();
    options.conservative = conservative;
    VisibilityField const field = build_visibility(model, options, context);
    VisibilitySelector selector(field, drawn_mesh(model.mesh, field.patches));
    RayScene const scene(model.mesh.vertices, {model.mesh.triangles.begin(),
                                               model.mesh.triangles.begin() + static_cast<std::ptrdiff_t>(inner)});
    for (auto const& eye : unseen_eyes(field, 10, 2, 5, 5)) {
      auto const is_drawn = selected(field, selector.select(eye));
      auto const visible = visible_triangles(
          scene, model.mesh.vertices,
          {model.mesh.triangles.begin(), model.mesh.triangles.begin() + static_cast<std::ptrdiff_t>(inner)}, eye, 12,
          context);
      for (std::size_t i = 0; i < is_drawn.size(); ++i) {
        EXPECT_TRUE(is_drawn[i] || (i < inner && !visible[i]));
      }
    }
  }
}

TEST(Visibility, PolygonsOfManySidesCountAsOne) {
  PolygonModel model;
  test::add_box(model.mesh, {-1, -1, -1}, {1, 1, 1}, 4);
  for (std::size_t i = 0; i < model.mesh.triangles.size(); ++i)
    model.polygons.push_back(static_cast<std::int32_t>(i / 2));
  Context context;
  VisibilityOptions options = quick();
  options.method = VisibilityMethod::id;
  VisibilityField const field = build_visibility(model, options, context);
  EXPECT_EQ(field.patches.count(), model.polygon_count());
  auto const figures = check_visibility(field, drawn_mesh(model.mesh, field.patches), model.polygons, true,
                                        unseen_eyes(field, 20, 2, 5, 2), 256, context);
  EXPECT_EQ(figures.wrong_pixels, 0U);
  EXPECT_GT(figures.culling_rate, 0.4);
}

TEST(Visibility, FillAddsNeighboursThatFaceTheCamera) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityOptions options = quick();
  options.method = VisibilityMethod::id;
  options.seen = Seen::in_picture;
  options.resolution = 32;
  std::size_t before = 0;
  for (int const fill : {0, 1, 2, -1}) {
    options.fill = fill;
    VisibilityField const field = build_visibility(model, options, context);
    std::size_t bits = 0;
    for (std::size_t row = 0; row < field.rows.rows(); ++row) {
      for (std::uint64_t const word : field.rows.row(row)) bits += static_cast<std::size_t>(std::popcount(word));
    }
    EXPECT_GT(bits, before);
    before = bits;
  }
}

TEST(Visibility, APersonsCamerasCoverTheirHalfSpaceAndSaySo) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityOptions options = quick();
  VisibilityField const ball = field_ball(model);
  for (SampleSphere const sphere = SampleSphere::octahedron(2); auto const& d : sphere.directions()) {
    if (d.z() > -1e-9) options.cameras.push_back(ball_camera(ball.center, ball.radius, d, 2.5, 200));
  }
  VisibilityField const field = build_visibility(model, options, context);
  ASSERT_EQ(context.warnings().size(), 1U);
  EXPECT_NE(context.warnings()[0].find("50.0 %"), std::string::npos) << context.warnings()[0];
  VisibilitySelector selector(field, drawn_mesh(model.mesh, field.patches));
  selector.select(field.center + field.radius * Eigen::Vector3d(0.4, 0.3, 3));
  EXPECT_FALSE(selector.is_whole());
  selector.select(field.center + field.radius * Eigen::Vector3d(0.4, 0.3, -3));
  EXPECT_TRUE(selector.is_whole());
}

TEST(SmallestSamples, SeeAllThatAnySampleSees) {
  BitRows rows(4, 6);
  for (auto const& [row, column] : {std::pair{0, 0}, {0, 1}, {1, 2}, {2, 1}, {2, 2}, {2, 3}, {2, 4}, {3, 3}})
    rows.set(static_cast<std::size_t>(row), static_cast<std::size_t>(column));
  EXPECT_EQ(smallest_samples(rows), (std::vector<std::size_t>{2, 0})) << "nobody sees column 5";
  Context context;
  VisibilityField const field = build_visibility(test::body(), quick(), context);
  auto const chosen = smallest_samples(field.rows);
  EXPECT_LT(chosen.size(), 40U);
  for (std::size_t column = 0; column < field.rows.columns(); ++column) {
    auto const sees = [&](std::size_t row) { return field.rows.test(row, column); };
    bool anyone = false;
    for (std::size_t row = 0; row < field.rows.rows(); ++row) anyone |= sees(row);
    EXPECT_EQ(std::any_of(chosen.begin(), chosen.end(), sees), anyone);
  }
}

TEST(Visibility, ARecordedPathIsReplayed) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityField const ball = field_ball(model);
  std::vector<SampleCamera> path;
  for (int i = 0; i < 50; ++i) {
    double const a = 0.04 * i;
    path.push_back(ball_camera(ball.center, ball.radius, {std::cos(a), std::sin(a), 0.2}, 1.5 + 0.02 * i, 300));
  }
  VisibilityField const field = build_path_visibility(model, path, 8, quick(), context);
  EXPECT_EQ(field.rows.rows(), 7U);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  VisibilitySelector selector(field, drawn);
  for (auto const& camera : path) {
    auto const ranges = selector.select(camera.object_from_camera.translation());
    EXPECT_FALSE(selector.is_whole());
    EXPECT_EQ(missed_pixels(drawn, ranges, camera).count, 0U);
    EXPECT_LT(selector.triangles(), drawn.triangles.size());
  }
  selector.select(ball.center + 8 * ball.radius * Eigen::Vector3d::UnitX());
  EXPECT_TRUE(selector.is_whole()) << "off the path nothing is known";
}

TEST(Visibility, InsideARoomCellsSeeTheirSide) {
  PolygonModel model;
  test::add_box(model.mesh, {0, 0, 0}, {4, 2, 2}, 12);
  for (auto& triangle : model.mesh.triangles) std::swap(triangle[1], triangle[2]);  // seen from inside
  test::add_box(model.mesh, {1.9F, 0, 0}, {2.1F, 2, 2}, 8);                         // a wall between two rooms
  Context context;
  Eigen::AlignedBox3d const box(Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(4, 2, 2));
  VisibilityField const field = build_grid_visibility(model, box, {8, 4, 4}, quick(), context);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  VisibilitySelector selector(field, drawn);
  for (std::uint64_t i = 0; i < 20; ++i) {
    CounterRandom random(3, i);
    Eigen::Vector3d const eye(0.1 + 1.2 * random.uniform(), 0.1 + 1.8 * random.uniform(), 0.1 + 1.8 * random.uniform());
    auto const is_drawn = selected(field, selector.select(eye));
    RayScene const scene(model.mesh.vertices, model.mesh.triangles);
    auto const visible = visible_triangles(scene, model.mesh.vertices, model.mesh.triangles, eye, 12, context);
    for (std::size_t t = 0; t < visible.size(); ++t) {
      EXPECT_TRUE(is_drawn[t] || !visible[t]);
    }
    EXPECT_LT(selector.triangles(), 0.75 * static_cast<double>(drawn.triangles.size())) << "the other room is hidden";
  }
  selector.select({5, 1, 1});
  EXPECT_TRUE(selector.is_whole());
}

TEST(VisibilityOptions, AreCheckedByName) {
  VisibilityOptions options;
  options.samples = 7;
  EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, "1026");
  options = {};
  options.shells = {3, 2};
  EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, "shells");
  options = {};
  options.resolution = 2;
  EXPECT_SCANVIEW_ERROR(options.validate(), ErrorCode::usage, "resolution");
}

}  // namespace
}  // namespace scanview
