#include <gtest/gtest.h>

#include <cmath>

#include "acquire/export.h"
#include "acquire/import.h"
#include "tests/temporary_folder.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// A ball before a background, from four sides. The outline is where importers may take depths away.
ScanSet make_ball() {
  ScanSet set;
  set.unit = Unit::mm;
  Camera const camera = Camera::perspective(64, 48, 70, 71, 31.25, 23.75);
  for (int v = 0; v < 4; ++v) {
    View view;
    view.name = "view_" + std::to_string(v);
    view.object_from_camera =
        Isometry3d(Eigen::AngleAxisd(v * 1.5, Vector3d(0.2, 1, 0.1).normalized())) * Eigen::Translation3d(0, 0, -200);
    view.image = empty_range_image(camera);
    view.image.color.create(camera.height(), camera.width());
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x) {
        view.image.color(y, x) = {uchar(4 * x), uchar(5 * y), uchar(60 * v)};
        view.image.classes(y, x) = static_cast<uchar>(PixelClass::background);
        Vector3d const d = camera.ray_direction(x, y), c(0, 0, 200);
        double const root = std::pow(d.dot(c), 2) - d.squaredNorm() * (c.squaredNorm() - 50 * 50);
        if (root < 0) continue;
        view.image.depth(y, x) = static_cast<float>((d.dot(c) - std::sqrt(root)) / d.squaredNorm());
        view.image.sigma(y, x) = 0.1f;
        view.image.classes(y, x) = static_cast<uchar>(PixelClass::object);
      }
    view.image.check();
    set.views.push_back(std::move(view));
  }
  return set;
}

/// What came back is what left: cameras and poses to rounding, depths to `tolerance`, nothing invented, and all but the
/// outline still there.
void expect_same_geometry(ScanSet const& before, ScanSet const& after, double tolerance) {
  ASSERT_EQ(after.views.size(), before.views.size());
  for (std::size_t v = 0; v < before.views.size(); ++v) {
    View const &a = before.views[v], &b = after.views[v];
    ASSERT_EQ(b.image.camera.width(), a.image.camera.width());
    ASSERT_EQ(b.image.camera.height(), a.image.camera.height());
    EXPECT_NEAR(b.image.camera.fx(), a.image.camera.fx(), 1e-9);
    EXPECT_NEAR(b.image.camera.fy(), a.image.camera.fy(), 1e-9);
    EXPECT_NEAR(b.image.camera.cx(), a.image.camera.cx(), 1e-9);
    EXPECT_NEAR(b.image.camera.cy(), a.image.camera.cy(), 1e-9);
    ASSERT_TRUE(b.object_from_camera.has_value());
    EXPECT_TRUE(b.object_from_camera->isApprox(*a.object_from_camera, 1e-9)) << v;
    std::size_t kept = 0;
    for (int y = 0; y < a.image.depth.rows; ++y)
      for (int x = 0; x < a.image.depth.cols; ++x) {
        EXPECT_EQ(b.image.color(y, x), a.image.color(y, x));
        if (!b.image.has_depth(x, y)) continue;
        ++kept;
        ASSERT_TRUE(a.image.has_depth(x, y)) << "invented";
        EXPECT_NEAR(b.image.depth(y, x), a.image.depth(y, x), tolerance);
      }
    EXPECT_GT(static_cast<double>(kept), 0.8 * static_cast<double>(a.image.count_depths()));
  }
}

TEST(ExportRoundTrip, ColmapComesBackWithItsGeometry) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_ball();
  export_colmap(folder.path() / "model", set, context);
  expect_same_geometry(set, import_colmap(folder.path() / "model", {}, context).set, 0);
}

TEST(ExportRoundTrip, NerfstudioComesBackWithItsGeometry) {
  TemporaryFolder folder;
  Context context;
  ScanSet const set = make_ball();
  export_nerfstudio(folder.path() / "nerf", set, context);
  // The greatest depth is below 200: steps of at most 200 / 65535 rounded up to two digits, 0.0031.
  expect_same_geometry(set, import_nerfstudio(folder.path() / "nerf", {}, context).set, 0.0031 / 2 * 1.001);
}

}  // namespace
}  // namespace scanview
