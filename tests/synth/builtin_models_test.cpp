#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <numeric>

#include "base/srgb.h"
#include "synth/basket.h"
#include "synth/basket_weave.h"
#include "synth/dog.h"
#include "synth/dog_shape.h"
#include "synth/ray_scene.h"
#include "synth/scanner.h"
#include "tests/synth/shapes.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

/// How many pieces hang together by triangles.
int count_pieces(TriangleMesh const& mesh) {
  std::vector<int> root(mesh.vertices.size());
  std::iota(root.begin(), root.end(), 0);
  auto const find = [&](int i) {
    while (root[i] != i) i = root[i] = root[root[i]];
    return i;
  };
  auto pieces = static_cast<int>(mesh.vertices.size());
  for (auto const& t : mesh.triangles)
    for (int c : {1, 2})
      if (int const a = find(t[0]), b = find(t[c]); a != b) {
        root[a] = b;
        --pieces;
      }
  return pieces;
}

struct Expected {
  char const* name;
  Vector3f size;  // mm, within 5
  double volume;  // mm³, at least
};

class BuiltinModel : public testing::TestWithParam<Expected> {};

TEST_P(BuiltinModel, IsOneClosedOutwardSolidOfTheSizeItClaims) {
  TriangleMesh const mesh = builtin_model(GetParam().name);
  mesh.check();
  EXPECT_EQ(count_pieces(mesh), 1);  // nothing floats, no bubbles inside
  EXPECT_TRUE(is_closed(mesh));
  EXPECT_GT(signed_volume(mesh), GetParam().volume);
  EXPECT_GT(mesh.triangles.size(), 200'000u);
  EXPECT_LT(mesh.triangles.size(), 600'000u);
  Eigen::AlignedBox3f box;
  for (auto const& v : mesh.vertices) box.extend(v);
  EXPECT_NEAR(box.min().y(), 0, 0.01);
  for (int axis = 0; axis < 3; ++axis) EXPECT_NEAR(box.sizes()[axis], GetParam().size[axis], 5);
  EXPECT_LT(std::abs(box.center().x()), 5);

  // Paint of every albedo from 0.04 to 0.9, but for the rounding to 8 bits (half of 1/255, slope of the sRGB curve at
  // most 2.3); a share of at least 2 % of it very dark, and of it very light.
  ASSERT_EQ(mesh.colors.size(), mesh.vertices.size());
  std::size_t dark = 0, light = 0;
  double const rounding = 0.5 / 255 * 2.3;
  double least = 1, most = 0;
  for (auto const& bgr : mesh.colors) {
    double sum = 0;
    for (int c = 0; c < 3; ++c) {
      double const albedo = linear_from_srgb(bgr[c] / 255.0);
      least = std::min(least, albedo);
      most = std::max(most, albedo);
      sum += albedo;
    }
    dark += sum / 3 < 0.1;
    light += sum / 3 > 0.6;
  }
  EXPECT_GE(least, 0.04 - rounding);
  EXPECT_LE(most, 0.9 + rounding);
  EXPECT_GT(dark, mesh.colors.size() / 50);
  EXPECT_GT(light, mesh.colors.size() / 50);
}

INSTANTIATE_TEST_SUITE_P(Synth, BuiltinModel,
                         testing::Values(Expected{"dog", {64, 125, 130}, 1e5}, Expected{"basket", {102, 131, 92}, 5e4}),
                         [](auto const& info) { return std::string(info.param.name); });

template <class Make>
void expect_same_for_one_and_two_threads(Make const& make) {
  Context one, two;
  one.threads = 1;
  two.threads = 2;
  TriangleMesh const a = make(2, one), b = make(2, two);
  EXPECT_GT(a.vertices.size(), 10'000u);
  EXPECT_EQ(a.vertices, b.vertices);
  EXPECT_EQ(a.triangles, b.triangles);
  EXPECT_EQ(a.colors, b.colors);
}

TEST(BuiltinDog, IsTheSameForAnyNumberOfThreads) { expect_same_for_one_and_two_threads(make_dog); }
TEST(BuiltinBasket, IsTheSameForAnyNumberOfThreads) { expect_same_for_one_and_two_threads(make_basket); }

TEST(BuiltinDog, OneSeesUnderItsBellyAndBetweenEarAndHead) {
  Context context;
  TriangleMesh const mesh = make_dog(1, context);
  RayScene const scene(mesh.vertices, mesh.triangles);
  for (float y : {3.0f, 12.0f, 22.0f})
    EXPECT_LT(scene.first_hit({100, y, -9}, {-1, 0, 0}).triangle, 0) << "side view at height " << y;
  for (float y : {3.0f, 12.0f, 22.0f})
    EXPECT_LT(scene.first_hit({0, y, 100}, {0, 0, -1}).triangle, 0) << "front view at height " << y;

  BladeShape const& ear = dog_left_ear();
  Blade const& b = ear.blade();
  Vector3f const middle = 0.25f * b.a + 0.5f * b.b + 0.25f * b.c, along = (b.c - b.a).normalized();
  Vector3f const across = (b.b - b.a).cross(b.c - b.a).normalized(), outwards = along.cross(across);
  Vector3f const p = dog_from_head(middle), n = (dog_from_head(middle + outwards) - p).normalized();
  // From outside and from the gap between ear and head, which is more than 2 mm wide; the fur's tufts add 0.16 mm, and
  // a tenth of the grid's spacing is what Newton leaves.
  float const clear = b.half_thickness + 2, tolerance = 0.16f + 0.1f;
  for (Vector3f const& direction : {n, Vector3f(-n)}) {
    RayHit const hit = scene.first_hit(p + clear * direction, -direction);
    ASSERT_GE(hit.triangle, 0);
    EXPECT_NEAR(hit.distance, 2, tolerance);
  }
}

TEST(BuiltinBasket, OneSeesThroughItsOpenBandAndUnderItsHandle) {
  Context context;
  TriangleMesh const mesh = make_basket(1, context);
  RayScene const scene(mesh.vertices, mesh.triangles);
  // Half way up the band, over each stake, the crossed rods leave a diamond open. Not where the handle is fixed.
  float const y = 0.5f * (kBasketBand + kBasketRim), wall = basket_wall_radius(y);
  for (int stake = 0; stake < kBasketStakes; ++stake) {
    if (stake % (kBasketStakes / 2) == kBasketStakes / 4) continue;
    float const angle = 2 * std::numbers::pi_v<float> * static_cast<float>(stake) / kBasketStakes;
    Vector3f const out(std::sin(angle), 0, std::cos(angle));
    RayHit const hit = scene.first_hit((wall + 2) * out + Vector3f(0, y, 0), -out);
    EXPECT_TRUE(hit.triangle < 0 || hit.distance > 4) << "over stake " << stake;
  }
  EXPECT_LT(scene.first_hit({0, kBasketHandleTop - 6, 100}, {0, 0, -1}).triangle, 0);
  EXPECT_GE(scene.first_hit({0, kBasketHandleTop, 100}, {0, 0, -1}).triangle, 0);
}

}  // namespace
}  // namespace scanview
