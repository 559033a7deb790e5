#include "viewer/visibility/visibility_file.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>

#include "base/random.h"
#include "expect_error.h"
#include "synth/visible_triangles.h"
#include "viewer/visibility/hidden_cells.h"
#include "viewer/visibility/visibility_check.h"
#include "visibility_models.h"

namespace scanview {
namespace {

using test::quick;
using test::selected;

TEST(Conservative, NothingThatRaysSeeIsLeftOut) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityOptions options = quick();
  options.conservative = true;
  options.patches = 1000;
  VisibilityField const field = build_visibility(model, options, context);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  VisibilitySelector selector(field, drawn);
  RayScene const scene(model.mesh.vertices, model.mesh.triangles);
  double culled = 0;
  auto const eyes = unseen_eyes(field, 40, 2, 50, 9);
  for (auto const& eye : eyes) {
    auto const is_drawn = selected(field, selector.select(eye));
    auto const visible = visible_triangles(scene, model.mesh.vertices, model.mesh.triangles, eye, 12, context);
    for (std::size_t t = 0; t < visible.size(); ++t) {
      EXPECT_TRUE(is_drawn[t] || !visible[t]);
    }
    culled += 1 - static_cast<double>(selector.triangles()) / static_cast<double>(drawn.triangles.size());
  }
  EXPECT_GT(culled / static_cast<double>(eyes.size()), 0.03) << "or it would prove nothing";
  EXPECT_EQ(check_visibility(field, drawn, {}, true, eyes, 512, context).wrong_pixels, 0U);
}

TEST(Conservative, WhatShowsThroughAHoleIsNotHidden) {
  PolygonModel model;  // an open bowl: its inside is seen from above
  test::add_sphere(model.mesh, {0, 0, 0}, 1, 4);
  std::erase_if(model.mesh.triangles, [&](Eigen::Vector3i const& t) {
    return model.mesh.vertices[static_cast<std::size_t>(t[0])].z() > 0.7F;
  });
  Context context;
  VisibilityOptions options = quick();
  options.conservative = true;
  options.patches = 200;
  VisibilityField const field = build_visibility(model, options, context);
  TriangleMesh const drawn = drawn_mesh(model.mesh, field.patches);
  EXPECT_EQ(check_visibility(field, drawn, {}, true, unseen_eyes(field, 60, 2, 5, 4), 512, context).wrong_pixels, 0U);
}

TEST(Conservative, OpenSheetsHideNothing) {
  PolygonModel model;
  test::add_rectangle(model.mesh, {-1, -1, 0}, {2, 0, 0}, {0, 2, 0}, 8);
  test::add_rectangle(model.mesh, {-1, -1, 0.3F}, {2, 0, 0}, {0, 2, 0}, 8);
  Context context;
  VisibilityOptions options = quick();
  options.conservative = true;
  VisibilityField const field = build_visibility(model, options, context);
  auto const figures = check_visibility(field, drawn_mesh(model.mesh, field.patches), {}, true,
                                        unseen_eyes(field, 20, 2, 5, 4), 256, context);
  EXPECT_EQ(figures.wrong_pixels, 0U);
  EXPECT_EQ(figures.culling_rate, 0);
}

TEST(VisibilityFile, ReadsWhatItWrote) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityOptions conservative = quick();
  conservative.conservative = true;
  conservative.samples = 18;
  VisibilityOptions cameras = quick();
  for (SampleSphere const sphere = SampleSphere::octahedron(1); auto const& d : sphere.directions())
    cameras.cameras.push_back(ball_camera({0, 0, 0}, 3, d + Eigen::Vector3d(0.01, 0.02, 0.03), 2, 100));
  std::vector<VisibilityField> const fields{
      build_visibility(model, quick(), context), build_visibility(model, conservative, context),
      build_visibility(model, cameras, context),
      build_path_visibility(model, {ball_camera({0, 0, 0}, 3, {1, 0, 0}, 2, 100)}, 1, quick(), context),
      build_grid_visibility(model, {Eigen::Vector3d(-1, -1, -1), Eigen::Vector3d(1, 1, 1)}, {2, 1, 3}, quick(),
                            context)};
  for (auto const& field : fields) {
    std::string const bytes = format_visibility(field, model.mesh);
    VisibilityField const again = parse_visibility(bytes, model, "m.vis");
    EXPECT_TRUE(again.rows == field.rows);
    EXPECT_EQ(again.patches.begins, field.patches.begins);
    EXPECT_EQ(again.patches.triangles, field.patches.triangles);
    EXPECT_EQ(format_visibility(again, model.mesh), bytes);
    Eigen::Vector3d const eye(3, -9, 4);
    EXPECT_EQ(again.query(eye).count, field.query(eye).count);
  }
}

TEST(VisibilityFile, CutOffAndFlippedFilesAreErrors) {
  PolygonModel const model = test::body();
  Context context;
  VisibilityOptions options = quick();
  options.samples = 6;
  std::string const bytes = format_visibility(build_visibility(model, options, context), model.mesh);
  for (std::size_t length = 0; length < bytes.size(); ++length) {
    EXPECT_SCANVIEW_ERROR(parse_visibility(std::string_view(bytes).substr(0, length), model, "m.vis"),
                          ErrorCode::bad_input, "m.vis");
  }
  for (std::size_t i = 0; i < 2000; ++i) {
    CounterRandom random(1, i);
    std::string flipped = bytes;
    std::size_t const at = random.below(static_cast<std::uint32_t>(bytes.size()));
    flipped[at] = static_cast<char>(flipped[at] ^ (1 << random.below(8)));
    EXPECT_SCANVIEW_ERROR(parse_visibility(flipped, model, "m.vis"), ErrorCode::bad_input, "m.vis");
  }
}

TEST(VisibilityFile, WhatWasRewrittenWithAGoodSumIsCheckedToo) {
  // The sum guards against accidents; a header that lies must not be believed either.
  PolygonModel const model = test::body();
  Context context;
  VisibilityOptions options = quick();
  options.samples = 6;
  std::string const bytes = format_visibility(build_visibility(model, options, context), model.mesh);
  std::size_t refused = 0;
  for (std::size_t i = 0; i < 3000; ++i) {
    CounterRandom random(2, i);
    std::string changed = bytes.substr(0, bytes.size() - 32);
    for (std::uint32_t k = random.below(3) + 1; k > 0; --k)
      changed[22 + random.below(static_cast<std::uint32_t>(changed.size() - 22))] =
          static_cast<char>(random.below(256));
    changed += hash_bytes(changed);
    try {
      parse_visibility(changed, model, "m.vis");
    } catch (Error const& error) {
      EXPECT_EQ(error.code(), ErrorCode::bad_input) << error.what();
      ++refused;
    }
  }
  EXPECT_GT(refused, 2900U);
}

TEST(VisibilityFile, BelongsToOneModel) {
  PolygonModel model = test::body();
  Context context;
  VisibilityOptions options = quick();
  options.samples = 6;
  std::string const bytes = format_visibility(build_visibility(model, options, context), model.mesh);
  model.mesh.vertices[7].x() += 1e-3F;
  EXPECT_SCANVIEW_ERROR(parse_visibility(bytes, model, "m.vis"), ErrorCode::bad_input, "another model");
}

}  // namespace
}  // namespace scanview
