#include "viewer/view_based/view_based_renderer.h"

#include <gtest/gtest.h>

#include "viewer/scene.h"

namespace scanview {
namespace {
using namespace test;
TEST(Smoke, Renders) {
  auto const context = make_offscreen_context();
  Camera const camera = Camera::perspective(160, 120, 150, 150, 80, 59);
  auto const pose = look_at({0, 1, 4}, {0, 0, 0});
  auto const scene = scan(sphere({0, 0, 0}, 1), camera, {pose}, 0.2, 0.05);
  auto const renderer = make_view_based_renderer(*context, scene.set, scene.meshes);
  auto const frame = renderer->render(camera, pose);
  EXPECT_GT(drawn_pixels(frame.color), 1000U);
  cv::Mat3b const p = bgr(frame.color);
  int worst = 0;
  for (int y = 0; y < 120; ++y)
    for (int x = 0; x < 160; ++x)
      if (frame.color(y, x)[3])
        for (int c = 0; c < 3; ++c)
          worst = std::max(worst, std::abs(int(p(y, x)[c]) - int(scene.set.views[0].image.color(y, x)[c])));
  EXPECT_LE(worst, 1);
}
}  // namespace
}  // namespace scanview
