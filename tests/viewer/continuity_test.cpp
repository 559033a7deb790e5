#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "base/random.h"
#include "viewer/scene.h"

namespace scanview {
namespace {

using namespace test;
using Eigen::Isometry3d;
using Eigen::Vector3d;
constexpr double kDegree = std::numbers::pi / 180;

Camera const kCamera = Camera::perspective(100, 100, 150, 150, 49.5, 49.5);

Isometry3d from(Vector3d const& direction) { return look_at(4 * direction, Vector3d::Zero(), Vector3d(0.01, 1, 0.02)); }

/// A ball of radius 1 from twelve views, neighbours about 25 degrees apart, around +z.
Scene cap() {
  std::vector<Isometry3d> poses;
  auto const add = [&](double from_z_deg, double around_deg) {
    double const a = from_z_deg * kDegree, b = around_deg * kDegree;
    poses.push_back(from({std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)}));
  };
  add(0, 0);
  for (int i = 0; i < 6; ++i) add(25, 60 * i + 5);
  for (int i = 0; i < 5; ++i) add(47, 72 * i + 20);
  return scan(sphere(Vector3d::Zero(), 1), kCamera, poses, 0.3, 0.02);
}

/// How fast weights change, a radian of the eye, inside the triangles of the view sphere: a triangle at distance d from
/// the centre, whose least height is h. The eye's ray meets it under an angle ψ with cos ψ >= d, so its foot moves by
/// at most d / cos² ψ <= 1 / d, and a barycentric coordinate changes by 1 / h a length.
double steepest_weight(std::vector<Vector3d> const& directions, std::vector<Eigen::Vector3i> const& triangles) {
  double steepest = 0;
  for (auto const& t : triangles) {
    Vector3d const a = directions[std::size_t(t[0])], b = directions[std::size_t(t[1])],
                   c = directions[std::size_t(t[2])];
    Vector3d const n = (b - a).cross(c - a);
    double const longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    steepest = std::max(steepest, longest / n.norm() / n.normalized().dot(a));
  }
  return steepest;
}

bool smooth(cv::Mat1f const& depth, int x, int y) {
  if (x < 1 || y < 1 || x + 1 >= depth.cols || y + 1 >= depth.rows) return false;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      if (!(std::abs(depth(y + dy, x + dx) - depth(y, x)) < 0.05)) return false;
    }
  }
  return true;
}

struct Move {
  Isometry3d before, after;
  double angle;
};

/// Turns of the camera about the ball's centre, half of them across an edge of the view sphere.
std::vector<Move> moves(std::vector<Vector3d> const& directions, std::vector<Eigen::Vector3i> const& triangles,
                        double angle, int count) {
  CounterRandom random(21, 0);
  std::vector<Move> result;
  auto const add = [&](Vector3d const& eye, Vector3d const& axis) {
    Isometry3d const pose = from(eye.normalized());
    result.push_back({pose, Eigen::AngleAxisd(angle, axis.normalized()) * pose, angle});
  };
  for (int i = 0; i < count; ++i) {
    auto const& t = triangles[random.below(std::uint32_t(triangles.size()))];
    Vector3d const a = directions[std::size_t(t[0])], b = directions[std::size_t(t[1])],
                   c = directions[std::size_t(t[2])];
    double const s = random.uniform(), r = random.uniform();
    if (i % 2 == 0) {
      Vector3d const inside = (a + s * (1 - r) * (b - a) + r * (c - a)).normalized();
      add(inside, inside.cross(Vector3d(random.normal(), random.normal(), random.normal())));
    } else {
      // From a third of the step before the edge to beyond it: the pole of its great circle is where it leads.
      Vector3d const pole = a.cross(b).normalized(), on_edge = (a + s * (b - a)).normalized();
      double const sign = random.uniform() < 0.5 ? 1 : -1;
      add(on_edge - sign * angle / 3 * pole, on_edge.cross(sign * pole));
    }
  }
  return result;
}

/// Checks the change of every pixel against its bound.
void expect_bounded(bool cosine) {
  Scene const scene = cap();
  auto const library = std::make_shared<ViewLibrary>(scene.set, scene.meshes);
  ViewBasedOptions options;
  options.cosine = cosine;
  auto const renderer = make_cpu_renderer(library, options);
  std::vector<Vector3d> directions;
  for (auto const& view : scene.set.views) directions.push_back(view.object_from_camera->translation().normalized());
  auto const triangles = renderer->sphere_triangles();
  ASSERT_GT(triangles.size(), 8U);
  double const weight_slope = steepest_weight(directions, triangles);
  EXPECT_LT(weight_slope, 6);  // 1 / (25 degrees sin 60) for even triangles is 2.6

  // The camera turns about the ball's centre, so that the point a pixel sees moves by angle · 1. paint() changes by at
  // most hypot(1.5, 4.5) = 4.75 a unit (blue) in linear light, which is at least 0.1: there sRGB rises by
  // 255 · 1.055 / 2.4 · 0.1^(1/2.4 - 1) = 429 a unit. Photographs in 8 bits add a step a texel (0.02 units).
  double const texture_slope = 4.75 * 429 + 50;
  // Rounding of both pictures, and vertices on a grid of 1/256 pixel: 0.027 units / 256 · texture_slope.
  double const rounding = 1 + 0.25;
  int compared = 0, elsewhere = 0, elsewhere_beyond = 0;
  double worst = 0;
  for (double const angle : {1e-4, 1e-3}) {
    for (auto const& move : moves(directions, triangles, angle, 100)) {
      auto const a = renderer->render(kCamera, move.before), b = renderer->render(kCamera, move.after);
      // What each view alone shows there: a change of shares by s changes the colour by at most s · (most - least).
      std::vector<Frame> alone;
      for (auto const& used : renderer->view_weights(kCamera, move.before)) {
        if (used.weight > 0) alone.push_back(renderer->render_alone(used.view, kCamera, move.before));
      }
      for (auto const& used : renderer->view_weights(kCamera, move.after)) {
        if (used.weight > 0) alone.push_back(renderer->render_alone(used.view, kCamera, move.before));
      }
      for (int y = 0; y < a.depth.rows; ++y) {
        for (int x = 0; x < a.depth.cols; ++x) {
          if (!smooth(a.depth, x, y) || !smooth(b.depth, x, y)) continue;
          Vector3d const p = move.before * kCamera.unproject(x, y, a.depth(y, x));
          // Within 15 degrees of the eye all three views, at most 25 degrees away from it, see the point at most 40
          // degrees off: 8.9 pixels inside their outline, where the feather is 1; depths agree within a threshold, and
          // nothing fills. Shares are w_i cos_i / sum, and all that jumps is the cosine, constant in a triangle: the
          // ball turns by 0.045 from one to the next, at an incidence of 51 degrees by 6 % of the cosine; and a share
          // s changes by 6 % of s (1 - s).
          bool const covered = p.normalized().dot(move.before.translation().normalized()) > std::cos(15 * kDegree);
          double share_change = 0.5 * 3 * weight_slope * angle;  // of three weights, half of what they change together
          if (cosine) share_change = 1.7 * share_change + 0.06 / 4 * 2;  // cosines of 0.6 to 1 under them
          for (int c = 0; c < 3; ++c) {
            int most = 0, least = 255;
            for (auto const& frame : alone) {
              if (frame.color(y, x)[3] == 0) continue;
              most = std::max(most, int(frame.color(y, x)[c]));
              least = std::min(least, int(frame.color(y, x)[c]));
            }
            double const bound = texture_slope * angle + share_change * (most - least) + rounding;
            double const change = std::abs(a.color(y, x)[c] - b.color(y, x)[c]);
            if (covered) {
              ++compared;
              worst = std::max(worst, change / bound);
              ASSERT_LE(change, bound) << x << ' ' << y << " angle " << angle;
            } else {
              ++elsewhere;
              elsewhere_beyond += change > bound + 0.05 * (most - least);
            }
          }
        }
      }
    }
  }
  EXPECT_GT(compared, 100000);
  EXPECT_GT(worst, 0.2);  // the bound is not beside the point
  // Towards the outlines of the views feathers and what fills also change.
  EXPECT_LT(elsewhere_beyond, 0.001 * elsewhere);
}

TEST(Continuity, ASmallMoveChangesSmoothPixelsByLittle) { expect_bounded(false); }
TEST(Continuity, CosinesByTriangleAddLittle) { expect_bounded(true); }

}  // namespace
}  // namespace scanview
