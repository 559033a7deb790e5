#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "mesh/polygon_model.h"
#include "tests/cli/command.h"
#include "tests/viewer/visibility_models.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class Visibility : public VerbTest {
 protected:
  void SetUp() override { write_triangle_mesh(in("model.ply"), test::body().mesh); }
};

TEST_F(Visibility, IsBuiltRenderedAndMissesNothing) {
  Json const built = run({"visibility", "build", in("model.ply"), "-o", in("m.vis"), "--samples", "258", "--resolution",
                          "256", "--glb", in("patches.glb")});
  EXPECT_EQ(built["polygons"], test::body().polygon_count());
  EXPECT_EQ(built["bytes"], fs::file_size(in("m.vis")));
  // The glTF file holds the same triangles, patch by patch.
  EXPECT_EQ(read_polygon_model(in("patches.glb")).polygon_count(), test::body().polygon_count());
  Json const rendered = run({"visibility", "render", in("model.ply"), in("m.vis"), "-o", in("pictures"), "--frames",
                             "4", "--size", "200", "--check", "--film"});
  EXPECT_EQ(rendered["wrong_pixels"], 0);
  EXPECT_EQ(rendered["frames"].size(), 4U);
  EXPECT_TRUE(fs::exists(in("pictures/003.png")));
  EXPECT_TRUE(fs::exists(in("pictures/film.png")));
}

TEST_F(Visibility, WhatItCannotUseIsRefusedByName) {
  auto const samples = run_scanview({"visibility", "build", in("model.ply"), "-o", in("m.vis"), "--samples", "100"});
  EXPECT_EQ(samples.exit_code, 2);
  EXPECT_THAT(samples.errors, HasSubstr("1026"));
  auto const shells = run_scanview({"visibility", "build", in("model.ply"), "-o", in("m.vis"), "--shells", "near"});
  EXPECT_EQ(shells.exit_code, 2);
  EXPECT_THAT(shells.errors, HasSubstr("near"));
  EXPECT_FALSE(fs::exists(in("m.vis")));
  write_file(in("m.vis"), "scanview visibility 1\n{}");
  auto const damaged = run_scanview({"visibility", "render", in("model.ply"), in("m.vis"), "-o", in("pictures")});
  EXPECT_EQ(damaged.exit_code, 3);
  EXPECT_THAT(damaged.errors, HasSubstr("m.vis"));
  EXPECT_FALSE(fs::exists(in("pictures")));
}

TEST_F(Visibility, TheReportHasThePapersCurves) {
  Json const report = run({"visibility", "report", in("model.ply"), "-o", in("page.html"), "--resolution", "128"});
  EXPECT_GT(report["limit"], 0.3);
  std::string const page = read_file(in("page.html"));
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, HasSubstr("exact limit"));
}

}  // namespace
}  // namespace scanview
