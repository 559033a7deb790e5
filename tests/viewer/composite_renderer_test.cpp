#include "viewer/blend/composite_renderer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "base/error.h"
#include "viewer/scene.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {
namespace {

using namespace test;
using Eigen::Isometry3d;
using Eigen::Vector3d;

/// A sheet of one colour through its own origin, seen from the front.
std::unique_ptr<Renderer> colored_sheet(Vector3d const& color, double half) {
  Camera const camera = Camera::perspective(160, 120, 150, 150, 80, 60);
  auto const scene = scan(sheet(0, half, 1, color), camera, {look_at({0, 0, 4}, Vector3d::Zero())}, 0.3, 0.02);
  return make_cpu_renderer(std::make_shared<ViewLibrary>(scene.set, scene.meshes));
}

Isometry3d moved(double x, double z) { return Isometry3d(Eigen::Translation3d(x, 0, z)); }

TEST(CompositeRenderer, TheNearestObjectShows) {
  std::vector<CompositeRenderer::Part> parts;
  parts.push_back({colored_sheet({1, 0, 0}, 1), Isometry3d::Identity()});
  parts.push_back({colored_sheet({0, 1, 0}, 0.3), moved(0, 0.5)});   // in front
  parts.push_back({colored_sheet({0, 0, 1}, 0.3), moved(0.6, -1)});  // behind, and reaching beyond
  CompositeRenderer scene(std::move(parts));
  Camera const camera = Camera::perspective(160, 120, 150, 150, 80, 60);
  Frame const frame = scene.render(camera, look_at({0, 0, 4}, Vector3d::Zero()));
  EXPECT_EQ(frame.color(60, 80), cv::Vec4b(0, 255, 0, 255));
  EXPECT_NEAR(frame.depth(60, 80), 3.5, 1e-4);
  EXPECT_EQ(frame.color(60, 55), cv::Vec4b(0, 0, 255, 255));
  EXPECT_NEAR(frame.depth(60, 55), 4, 1e-4);
  EXPECT_EQ(frame.color(10, 150)[3], 0);
  EXPECT_TRUE(std::isnan(frame.depth(10, 150)));
  // From beside, what lay behind shows past the edge.
  Frame const side = scene.render(camera, look_at({3.5, 0, 2}, Vector3d(0.6, 0, -1)));
  int blue = 0;
  for (auto const& pixel : side.color) blue += pixel == cv::Vec4b(255, 0, 0, 255);
  EXPECT_GT(blue, 50);
}

TEST(CompositeRenderer, NeedsAnObject) { EXPECT_THROW(CompositeRenderer({}), Error); }

}  // namespace
}  // namespace scanview
