#include "viewer/select/view_sphere.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <map>
#include <numbers>

#include "base/error.h"
#include "base/random.h"
#include "viewer/select/view_selection.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
constexpr double kDegree = std::numbers::pi / 180;

Vector3d random_direction(CounterRandom& random) {
  Vector3d v;
  do v = {random.normal(), random.normal(), random.normal()};
  while (v.norm() < 1e-3);
  return v.normalized();
}

Vector3d at(double azimuth_deg, double elevation_deg) {
  double const a = azimuth_deg * kDegree, e = elevation_deg * kDegree;
  return {std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e)};
}

std::vector<Vector3d> ring(int count, double elevation_deg, double noise = 0, double azimuths_deg = 360) {
  CounterRandom random(7, 0);
  std::vector<Vector3d> result;
  for (int i = 0; i < count; ++i) {
    Vector3d const jitter(random.normal(), random.normal(), random.normal());
    result.push_back((at(azimuths_deg * i / count, elevation_deg) + noise * jitter).normalized());
  }
  return result;
}

std::vector<Vector3d> random_views(int count, std::uint64_t seed, double least_z = -1) {
  CounterRandom random(seed, 0);
  std::vector<Vector3d> result;
  while (result.size() < static_cast<std::size_t>(count)) {
    Vector3d const v = random_direction(random);
    // At least 5 degrees apart, so that the steepness of the weights is bounded.
    bool fits = v.z() >= least_z;
    for (auto const& other : result) fits = fits && v.dot(other) < std::cos(5 * kDegree);
    if (fits) result.push_back(v);
  }
  return result;
}

/// Every kind of set that there is.
std::map<std::string, std::vector<Vector3d>> const& sets() {
  static std::map<std::string, std::vector<Vector3d>> const all{
      {"one view", {at(20, 30)}},
      {"two views", {at(20, 30), at(80, 10)}},
      {"two antipodes", {at(20, 30), -at(20, 30)}},
      {"three views", {at(20, 30), at(80, 10), at(50, 60)}},
      {"three on a great circle, one side", {at(0, 0), at(30, 0), at(100, 0)}},
      {"duplicates", {at(20, 30), at(20, 30), at(80, 10), at(150, -20), at(80, 10)}},
      {"turntable at the equator", ring(8, 0)},
      {"turntable at 32 degrees", ring(8, 32)},
      {"turntable at 32 degrees, measured", ring(8, 32, 0.01)},
      {"turntable at the equator, measured", ring(20, 0, 0.01)},
      {"turntable from below", ring(12, -20)},
      {"turntable nearly at the pole", ring(12, 85)},
      {"part of a turntable", ring(6, 10, 0, 150)},
      {"two rings",
       [] {
         auto views = ring(8, 10);
         for (auto const& v : ring(8, 50)) views.push_back(v);
         return views;
       }()},
      {"octahedron", {at(0, 0), at(90, 0), at(180, 0), at(270, 0), at(0, 90), at(0, -90)}},
      {"four of a cube", ring(4, 35.264389682754654)},
      {"all around", random_views(40, 1)},
      {"a few all around", random_views(7, 2)},
      {"a hemisphere", random_views(25, 3, 0.05)},
      {"a cap", random_views(9, 4, 0.9)},
  };
  return all;
}

std::map<std::size_t, double> weights_of(ViewSphere const& sphere, Vector3d const& eye) {
  std::map<std::size_t, double> result;
  for (auto const& w : sphere.weights(eye)) result[w.view] = w.weight;
  return result;
}

double change(std::map<std::size_t, double> a, std::map<std::size_t, double> b) {
  double most = 0;
  for (auto const& [view, weight] : a) most = std::max(most, std::abs(weight - b[view]));
  for (auto const& [view, weight] : b) most = std::max(most, std::abs(weight - a[view]));
  return most;
}

TEST(ViewSphere, WeightsAreAPartitionOfUnity) {
  for (auto const& [name, directions] : sets()) {
    SCOPED_TRACE(name);
    ViewSphere const sphere(directions);
    CounterRandom random(11, 0);
    for (int i = 0; i < 2000; ++i) {
      double sum = 0;
      auto const weights = sphere.weights(random_direction(random) * 3.0);
      for (auto const& w : weights) {
        EXPECT_GT(w.weight, 0);
        EXPECT_LT(w.view, directions.size());
        sum += w.weight;
      }
      ASSERT_NEAR(sum, 1, 1e-12);
      ASSERT_LE(weights.size(), 7U + (name == "duplicates" ? 2U : 0U));
    }
  }
}

TEST(ViewSphere, AViewAtTheEyeHasAllTheWeight) {
  for (auto const& [name, directions] : sets()) {
    if (name == "duplicates") continue;
    SCOPED_TRACE(name);
    ViewSphere const sphere(directions);
    for (std::size_t i = 0; i < directions.size(); ++i) {
      EXPECT_NEAR(weights_of(sphere, 0.1 * directions[i])[i], 1, 1e-9);
    }
  }
}

TEST(ViewSphere, WeightsAreContinuousAlongArcs) {
  // Great arcs in random directions cross edges, virtual corners and empty sides. A jump would not shrink with the
  // step; a slope does. Views are at least 5 degrees (0.087) apart, so a weight may change by about 1/0.087 a radian on
  // an edge; faces can be a few times lower than their edges are long, and the enlargement at empty caps adds 1/0.35:
  // 300 a radian is a generous bound, and with steps of 1e-5 a jump of 0.003 is found.
  for (auto const& [name, directions] : sets()) {
    SCOPED_TRACE(name);
    ViewSphere const sphere(directions);
    CounterRandom random(12, 0);
    double steepest = 0;
    for (int arc = 0; arc < 60; ++arc) {
      Vector3d const start = random_direction(random), side = start.cross(random_direction(random)).normalized();
      Vector3d at_step = start;
      for (int coarse = 0; coarse < 180; ++coarse) {
        // One fine step at each coarse position, and the coarse step itself.
        double const angle = 2 * std::numbers::pi * coarse / 180;
        at_step = std::cos(angle) * start + std::sin(angle) * side;
        Vector3d const next = std::cos(angle + 1e-5) * start + std::sin(angle + 1e-5) * side;
        steepest = std::max(steepest, change(weights_of(sphere, at_step), weights_of(sphere, next)) / 1e-5);
      }
    }
    EXPECT_LT(steepest, 300);
  }
}

TEST(ViewSphere, AlongARandomWalkWeightsAreLipschitz) {
  // 10 000 steps of 1e-7 to 1e-2 radians, each with its own bound. The constant is that of
  // WeightsAreContinuousAlongArcs for all sets. For the octahedron it is exact: a face at distance d = 1/sqrt(3) from
  // the centre with heights h = sqrt(3/2). An eye's ray under the angle ψ to its normal, cos ψ >= d, moves its foot by
  // at most 1/d a radian, and a weight by 1/h a length: 1 / (d h) = sqrt(2).
  for (auto const& [name, directions] : sets()) {
    SCOPED_TRACE(name);
    double const lipschitz = name == "octahedron" ? std::sqrt(2) : 300;
    ViewSphere const sphere(directions);
    CounterRandom random(18, 0);
    Vector3d eye = random_direction(random);
    auto at_eye = weights_of(sphere, eye);
    std::size_t face = 0;
    for (int i = 0; i < 10000; ++i) {
      double const step = std::pow(10.0, -7 + 5 * random.uniform());
      // Now and then onto the plane through two views and the centre, where an edge may be.
      Vector3d next = (eye + step * random_direction(random)).normalized();
      if (i % 10 == 0 && directions.size() > 1) {
        auto const& a = directions[random.below(std::uint32_t(directions.size()))];
        auto const& b = directions[random.below(std::uint32_t(directions.size()))];
        eye = (a + random.uniform() * (b - a) + 1e-3 * Vector3d(random.normal(), random.normal(), random.normal()))
                  .normalized();
        at_eye = weights_of(sphere, eye);
        next = eye;
        if (a.cross(b).norm() > 1e-3) {
          Vector3d const pole = a.cross(b).normalized();
          next = (eye - 1.5 * eye.dot(pole) * pole).normalized();  // across it
        }
      }
      double const angle = std::atan2(eye.cross(next).norm(), eye.dot(next));
      auto const at_next = weights_of(sphere, next);
      ASSERT_LE(change(at_eye, at_next), lipschitz * angle * (1 + 1e-6) + 1e-12) << i;
      // And where the search starts does not matter.
      std::map<std::size_t, double> walked;
      for (auto const& w : sphere.weights(next, face)) walked[w.view] = w.weight;
      ASSERT_LE(change(walked, at_next), 1e-12) << i;
      eye = next;
      at_eye = at_next;
    }
  }
}

TEST(ViewSphere, WeightsDoNotJumpAnywhereOnAnArc) {
  // Bisection: from the two ends of an arc towards the half that changes more. At a jump the change stays; along a
  // slope of at most 300 a radian it is below 1e-6 after the step has shrunk to 1e-9.
  for (auto const& [name, directions] : sets()) {
    SCOPED_TRACE(name);
    ViewSphere const sphere(directions);
    CounterRandom random(13, 0);
    for (int arc = 0; arc < 300; ++arc) {
      Vector3d a = random_direction(random), b = (a + 0.3 * random_direction(random)).normalized();
      auto at_a = weights_of(sphere, a), at_b = weights_of(sphere, b);
      while ((a - b).norm() > 1e-9) {
        Vector3d const middle = (a + b).normalized();
        auto const at_middle = weights_of(sphere, middle);
        if (change(at_a, at_middle) > change(at_middle, at_b)) {
          b = middle;
          at_b = at_middle;
        } else {
          a = middle;
          at_a = at_middle;
        }
      }
      ASSERT_LT(change(at_a, at_b), 1e-6);
    }
  }
}

TEST(ViewSphere, WeightsJumpNotAcrossSymmetryDirections) {
  // The directions where ties are: poles, the opposite of views and of their mean, circumcentres.
  for (auto const& [name, directions] : sets()) {
    SCOPED_TRACE(name);
    ViewSphere const sphere(directions);
    std::vector<Vector3d> special{Vector3d::UnitX(), Vector3d::UnitY(), Vector3d::UnitZ()};
    for (auto const& d : directions) special.push_back(d);
    for (std::size_t i = 0; i + 2 < directions.size(); ++i) {
      Vector3d const n = (directions[i + 1] - directions[i]).cross(directions[i + 2] - directions[i]);
      if (n.norm() > 1e-9) special.push_back(n.normalized());
    }
    CounterRandom random(14, 0);
    for (auto const& s : special) {
      for (double const sign : {1.0, -1.0}) {
        auto const here = weights_of(sphere, sign * s);
        for (int i = 0; i < 20; ++i) {
          Vector3d const near = (sign * s + 1e-7 * random_direction(random)).normalized();
          ASSERT_LT(change(here, weights_of(sphere, near)), 300 * 1e-7);
        }
      }
    }
  }
}

TEST(ViewSphere, InsideATriangleWeightsAreBarycentricOnTheHull) {
  std::vector<Vector3d> const directions{at(0, 0), at(90, 0), at(180, 0), at(270, 0), at(0, 90), at(0, -90)};
  ViewSphere const sphere(directions);
  EXPECT_EQ(sphere.triangles().size(), 8U);
  // The ray (1, 2, 3) meets the face x + y + z = 1 at (1, 2, 3)/6.
  auto weights = weights_of(sphere, {1, 2, 3});
  EXPECT_NEAR(weights[0], 1.0 / 6, 1e-12);
  EXPECT_NEAR(weights[1], 2.0 / 6, 1e-12);
  EXPECT_NEAR(weights[4], 3.0 / 6, 1e-12);
}

TEST(ViewSphere, DuplicatesShare) {
  ViewSphere const sphere({at(0, 0), at(90, 0), at(0, 0), at(180, 0)});
  auto weights = weights_of(sphere, at(0, 0));
  EXPECT_NEAR(weights[0], 0.5, 1e-12);
  EXPECT_NEAR(weights[2], 0.5, 1e-12);
}

TEST(ViewSphere, OneViewHasAllTheWeightEverywhere) {
  ViewSphere const sphere({{0, 0, 5}});
  CounterRandom random(15, 0);
  for (int i = 0; i < 100; ++i) EXPECT_NEAR(weights_of(sphere, random_direction(random))[0], 1, 1e-12);
}

TEST(ViewSphere, TwoViewsMeetHalfway) {
  ViewSphere const sphere({at(0, 0), at(60, 0)});
  for (double const elevation : {-80.0, -30.0, 0.0, 30.0, 80.0}) {
    EXPECT_NEAR(weights_of(sphere, at(30, elevation))[0], 0.5, 1e-9);
  }
  EXPECT_GT(weights_of(sphere, at(10, 20))[0], 0.75);
  EXPECT_GT(weights_of(sphere, at(50, -20))[1], 0.75);
}

TEST(ViewSphere, OnATurntableTheElevationDoesNotMatter) {
  // 8 views at 32 degrees, from 25 degrees below the horizon to 60 above it: the two neighbours alone. At -25 degrees
  // the share of the views in the triangle with the pole below is 0.53, above 0.35; at 60 degrees with the pole above
  // 0.46.
  ViewSphere const sphere(ring(8, 32));
  EXPECT_TRUE(sphere.triangles().empty());
  for (double const azimuth : {0.0, 5.0, 22.5, 40.0}) {
    auto const expected = weights_of(sphere, at(azimuth, 32));
    EXPECT_LE(expected.size(), 2U);
    for (double const elevation : {-25.0, 0.0, 20.0, 45.0, 60.0}) {
      EXPECT_LT(change(expected, weights_of(sphere, at(azimuth, elevation))), 1e-9);
    }
  }
  EXPECT_NEAR(weights_of(sphere, at(22.5, 50))[1], 0.5, 1e-9);
}

TEST(ViewSphere, AtThePoleOfATurntableThreeViewsShare) {
  ViewSphere const sphere(ring(9, 20));
  for (double const pole : {90.0, -90.0}) {
    auto const weights = weights_of(sphere, at(0, pole));
    ASSERT_EQ(weights.size(), 3U);
    for (auto const& [view, weight] : weights) EXPECT_NEAR(weight, 1.0 / 3, 1e-9);
    // A third of a turn apart: every third of nine views.
    EXPECT_EQ(weights.begin()->first % 3, std::next(weights.begin())->first % 3);
  }
}

TEST(ViewSphere, WeightsTurnWithTheViews) {
  auto const directions = random_views(20, 5);
  Eigen::Matrix3d const turn = Eigen::AngleAxisd(1.234, Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  std::vector<Vector3d> turned;
  for (auto const& d : directions) turned.push_back(turn * d);
  ViewSphere const sphere(directions), turned_sphere(turned);
  CounterRandom random(16, 0);
  for (int i = 0; i < 200; ++i) {
    Vector3d const eye = random_direction(random);
    EXPECT_LT(change(weights_of(sphere, eye), weights_of(turned_sphere, turn * eye)), 1e-9);
  }
}

TEST(ViewSphere, RefusesViewsWithoutDirection) {
  EXPECT_THROW(ViewSphere({}), Error);
  EXPECT_THROW(ViewSphere({Vector3d::Zero()}), Error);
  EXPECT_THROW(ViewSphere({Vector3d(1, NAN, 0)}), Error);
  EXPECT_THROW(ViewSphere({Vector3d(1, 0, 0)}).weights(Vector3d::Zero()), Error);
}

TEST(FillViews, AreTheNearestAndDoNotPop) {
  auto const directions = random_views(30, 6);
  ViewSphere const sphere(directions);
  CounterRandom random(17, 0);
  auto const filled = [&](Vector3d const& eye) {
    std::map<std::size_t, double> result;
    for (auto const& used : add_fill_views(sphere.weights(eye), directions, eye, 4)) result[used.view] = used.fill;
    return result;
  };
  for (int i = 0; i < 500; ++i) {
    Vector3d const eye = random_direction(random);
    auto const fill = filled(eye);
    for (auto const& [view, value] : fill) EXPECT_TRUE(value >= 0 && value <= 1);
    EXPECT_EQ(std::count_if(fill.begin(), fill.end(), [](auto const& f) { return f.second > 0; }), 7);
    Vector3d const near = (eye + 1e-7 * random_direction(random)).normalized();
    // 1 - angle / horizon: the horizon is at least 5 degrees away.
    EXPECT_LT(change(fill, filled(near)), 2e-7 / (5 * kDegree));
  }
}

TEST(FillViews, NoneIsThePapersMethod) {
  auto const directions = random_views(10, 8);
  ViewSphere const sphere(directions);
  Vector3d const eye = at(10, 20);
  auto const weights = sphere.weights(eye);
  auto const used = add_fill_views(weights, directions, eye, 0);
  ASSERT_EQ(used.size(), weights.size());
  for (std::size_t i = 0; i < used.size(); ++i) {
    EXPECT_EQ(used[i].weight, weights[i].weight);
    EXPECT_EQ(used[i].fill, 0);
  }
}

}  // namespace
}  // namespace scanview
