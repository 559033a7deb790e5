#include <gtest/gtest.h>

#include <cmath>

#include "base/srgb.h"
#include "viewer/rooms.h"

// How several nodes become one picture. Walls of one colour a node show whose sample a pixel is.

namespace scanview::test {
namespace {

using Eigen::Vector3d;

constexpr double kHalf = 2;  // of the room

NodeMesh node_at(Vector3d const& position, Vector3d const& color, int size = 32) {
  return mesh_of(capture_cube(room(kHalf, plain(color)), position, size));
}

double linear(uchar byte) { return linear_from_srgb8()[byte]; }

WalkthroughOptions with(MergePolicy policy) {
  WalkthroughOptions options;
  options.policy = policy;
  options.silhouettes = WalkthroughOptions::Silhouettes::keep;
  return options;
}

Vector3d const kRed(0.6, 0, 0), kBlue(0, 0, 0.6);

/// Two nodes beside each other before the wall z = −2, an eye between them.
struct Pair {
  Vector3d left{-0.8, 0, -0.5}, right{0.9, 0, 0.3}, eye{-0.2, 0.1, 0.1};
  std::vector<NodeMesh> nodes = {node_at(left, kRed), node_at(right, kBlue)};
  Camera camera = square_camera(64, 40);
  Eigen::Isometry3d pose = look_at(eye, eye - Vector3d::UnitZ());

  /// Of a pixel that shows that wall; nothing: another one.
  std::optional<Vector3d> point(int x, int y) const {
    Vector3d const d = pose.linear() * camera.ray_direction(x, y), p = eye + (-kHalf - eye.z()) / d.z() * d;
    if (p.head<2>().cwiseAbs().maxCoeff() > kHalf - 0.2) return std::nullopt;
    return p;
  }
  template <typename Do>
  int for_each_point(Do const& act) const {
    int count = 0;
    for (int y = 0; y < camera.height(); ++y)
      for (int x = 0; x < camera.width(); ++x)
        if (auto const p = point(x, y)) {
          act(x, y, *p);
          ++count;
        }
    return count;
  }
};

/// A level of sRGB is at most 2.4 / 1.055 / 255 of light, of 0.6 here, and once more for the texel; and qualities have
/// 16 bits.
constexpr double kLevel = 2.4 / 1.055 / 255 / 0.6 + 1e-4;

/// Of what a pixel shows of a node: its triangle's |N · R|, or the mean of the vertices' with their parts.
double quality_at(NodeMesh const& mesh, NodeQuality kind, Eigen::Isometry3d const& pose, Camera const& camera, int x,
                  int y) {
  auto const hit = meet(mesh, pose.translation(), pose.linear() * camera.ray_direction(x, y));
  if (!hit) return NAN;
  if (kind == NodeQuality::flat) return mesh.quality[hit->triangle];
  std::vector<float> const smooth = mesh.smooth_quality();
  double sum = 0;
  for (int i = 0; i < 3; ++i) {
    int const v = mesh.triangles[hit->triangle][i];
    double const d = kind == NodeQuality::density ? std::max(1.0, mesh.vertices[v].cast<double>().norm()) : 1;
    sum += hit->weights[i] * smooth[v] / (d * d);  // walking radius 1
  }
  return sum;
}

TEST(MergePolicies, WeightedIsTheMeanByQuality) {
  // §6.3: (q1 c1 + q2 c2) / (q1 + q2), each q of the triangle that the pixel shows; of density q⁴ (NodeQuality).
  Pair const pair;
  for (auto const kind : {NodeQuality::flat, NodeQuality::smooth, NodeQuality::density}) {
    auto renderer = renderer_of(pair.nodes, 1, with(MergePolicy::weighted), kind);
    Frame const frame = renderer.render(pair.camera, pair.pose);
    int differing = 0;
    int const count = pair.for_each_point([&](int x, int y, Vector3d const&) {
      double q[2];
      for (int n = 0; n < 2; ++n) {
        q[n] = quality_at(pair.nodes[n], kind, pair.pose, pair.camera, x, y);
        if (kind == NodeQuality::density) q[n] = std::pow(q[n], 4);
      }
      cv::Vec4b const& c = frame.color(y, x);
      double const red = linear(c[2]) / 0.6, expected = q[0] / (q[0] + q[1]);
      differing += std::abs(red - expected) > kLevel;
    });
    EXPECT_GT(count, 2000);
    // Beside a triangle's edge, which vertices snapped to 1/256 pixel move, the pixel may be of the next one.
    EXPECT_LE(differing, count / 100) << int(kind);
  }
}

TEST(MergePolicies, BinaryTakesTheBetterEverywhere) {
  Pair const pair;
  for (auto const kind : {NodeQuality::flat, NodeQuality::smooth, NodeQuality::density}) {
    auto renderer = renderer_of(pair.nodes, 1, with(MergePolicy::binary), kind);
    Frame const frame = renderer.render(pair.camera, pair.pose);
    int wins[2] = {0, 0}, wrong = 0;
    int const count = pair.for_each_point([&](int x, int y, Vector3d const&) {
      cv::Vec4b const& c = frame.color(y, x);
      ASSERT_TRUE((c[2] == 0) != (c[0] == 0)) << "a mixture at " << x << ' ' << y;
      double const a = quality_at(pair.nodes[0], kind, pair.pose, pair.camera, x, y),
                   b = quality_at(pair.nodes[1], kind, pair.pose, pair.camera, x, y);
      if (std::abs(a - b) < 1e-3) return;
      ++wins[a > b ? 0 : 1];
      wrong += (c[2] != 0) != (a > b);
    });
    EXPECT_GT(count, 2000);
    EXPECT_GT(wins[0], 100);
    EXPECT_GT(wins[1], 100);
    EXPECT_LE(wrong, kind == NodeQuality::flat ? count / 100 : 0) << int(kind);  // beside edges of triangles, as above
  }
}

TEST(MergePolicies, PositionalWeighsByTheEyesPlaceBetweenTwoNodes) {
  // §6.4: of two nodes the first counts t = d2 / (d1 + d2), the second 1 − t, times their qualities.
  Pair const pair;
  auto renderer = renderer_of(pair.nodes, 1, with(MergePolicy::positional), NodeQuality::smooth);
  for (double const x : {-0.75, -0.3, 0.0, 0.5}) {
    Eigen::Isometry3d pose = pair.pose;
    pose.translation() = Vector3d(x, 0.1, 0);
    double const d1 = (pose.translation() - pair.left).norm(), d2 = (pose.translation() - pair.right).norm();
    double const t = d2 / (d1 + d2);
    Frame const frame = renderer.render(pair.camera, pose);
    ASSERT_EQ(renderer.used().size(), 2U);
    for (UsedNode const& used : renderer.used()) EXPECT_NEAR(used.weight, used.node == 0 ? t : 1 - t, 1e-12);
    int differing = 0;
    for (int y = 20; y < 44; ++y)
      for (int column = 20; column < 44; ++column) {
        double const q1 = quality_at(pair.nodes[0], NodeQuality::smooth, pose, pair.camera, column, y),
                     q2 = quality_at(pair.nodes[1], NodeQuality::smooth, pose, pair.camera, column, y);
        double const red = linear(frame.color(y, column)[2]) / 0.6;
        differing += std::abs(red - t * q1 / (t * q1 + (1 - t) * q2)) > kLevel;
      }
    EXPECT_LE(differing, 24 * 24 / 100) << x;
  }
}

TEST(MergePolicies, LayeringTakesTheNearest) {
  // Two nodes disagree about the walls' place by more than their errors of 0.1 / 16 in 1/z, 0.03 units at 2: the nearer
  // depth is drawn, whole.
  NodeMeshOptions exact;
  exact.parallax_px = 0.1;
  NodeMesh const far = mesh_of(capture_cube(room(kHalf, plain(kRed)), {0, 0, 0}, 32), exact);
  NodeMesh const near = mesh_of(capture_cube(room(kHalf - 0.2, plain(kBlue)), {0.1, 0, 0}, 32), exact);
  auto renderer = renderer_of({far, near}, 1, with(MergePolicy::layering));
  CounterRandom random(3, 0);
  for (int look = 0; look < 20; ++look)
    for (cv::Vec4b const& c : renderer.render(square_camera(16, 8), random_look({0, 0, 0}, random)).color) {
      ASSERT_EQ(c[2], 0);
      ASSERT_GT(c[0], 100);
    }
}

TEST(MergePolicies, TwoNodesInOnePlaceAreAsOne) {
  Vector3d const at(0.2, -0.3, 0.1);
  NodeMesh const node = mesh_of(capture_cube(room(kHalf, by_direction(4)), at, 32));
  for (MergePolicy const policy : kMergePolicies) {
    WalkthroughOptions options;
    options.policy = policy;
    auto one = renderer_of({node}, 1, options), two = renderer_of({node, node}, 1, options);
    CounterRandom random(4, 0);
    for (int look = 0; look < 20; ++look) {
      Eigen::Isometry3d const pose = random_look(look == 0 ? at : Vector3d(0.1, 0.1, 0.3), random);
      Frame const a = one.render(square_camera(24, 12), pose), b = two.render(square_camera(24, 12), pose);
      // (w c + w c) / 2 w, rounded in single precision.
      ASSERT_LE(cv::norm(a.color, b.color, cv::NORM_INF), 1) << to_string(policy);
      for (float const z : cv::Mat1f(b.depth)) ASSERT_TRUE(std::isfinite(z));
      for (UsedNode const& used : two.used()) ASSERT_TRUE(std::isfinite(used.weight));
    }
  }
}

TEST(MergePolicies, OfOneNodeAllPoliciesDrawTheSame) {
  Surface const scene = together({room(kHalf, by_direction(4)), sphere({0.5, 0.2, -0.9}, 0.3)});
  NodeMesh const node = mesh_of(capture_cube(scene, Vector3d::Zero(), 32));
  CounterRandom random(6, 0);
  for (int look = 0; look < 10; ++look) {
    Eigen::Isometry3d const pose = random_look(0.5 * random_direction(random), random);
    std::vector<Frame> frames;
    for (MergePolicy const policy : kMergePolicies) {
      auto renderer = renderer_of({node}, 1, with(policy));
      frames.push_back(renderer.render(square_camera(32, 16), pose));
      EXPECT_LE(cv::norm(frames[0].color, frames.back().color, cv::NORM_INF), 1) << to_string(policy);
    }
  }
}

TEST(MergePolicies, NoNodeComesOrGoesWithAJump) {
  // Four nodes, three merged: on the way from the first to the last the sets of the nearest three change. The picture
  // moves by as little there as anywhere.
  std::vector<Vector3d> const places = {{-1, 0, 0}, {-0.2, 0.4, 0}, {0.3, -0.5, 0.2}, {1, 0.1, 0}};
  std::vector<Vector3d> const colors = {{0.6, 0, 0}, {0, 0.6, 0}, {0, 0, 0.6}, {0.5, 0.5, 0.5}};
  for (bool const has_steps : {false, true}) {
    std::vector<NodeMesh> nodes;
    for (std::size_t i = 0; i < places.size(); ++i) {
      // With a box before the wall each node hides and shows other parts of it.
      Surface const walls = room(kHalf, plain(colors[i]));
      Surface const scene = together({walls, solid_box({-0.3, -1, -1.2}, {0.3, 1, -1}, plain(kRed))});
      nodes.push_back(mesh_of(capture_cube(has_steps ? scene : walls, places[i], 64)));
    }
    auto renderer = renderer_of(nodes, 1, with(MergePolicy::positional));
    auto const last_node = [&] { return renderer.used()[2].node; };
    auto const render = [&](double x) {
      Vector3d const eye(x, 0, 0.2);
      return renderer.render(square_camera(96, 48), look_at(eye, eye - Vector3d::UnitZ()));
    };
    int switches = 0;
    for (double x = -0.9; x < 0.9; x += 0.05) {
      render(x);
      std::size_t const before = last_node();
      render(x + 0.05);
      if (last_node() == before) continue;
      double low = x, high = x + 0.05;
      while (high - low > 1e-9) {
        double const middle = (low + high) / 2;
        render(middle);
        (last_node() == before ? low : high) = middle;
      }
      cv::Mat4b const a = render(low).color.clone(), b = render(high).color;
      EXPECT_LE(cv::norm(a, b, cv::NORM_INF), 1) << "at " << low << (has_steps ? " with steps" : "");
      ++switches;
    }
    EXPECT_GE(switches, 2);
  }
}

TEST(MergePolicies, FillingChangesOnlyGaps) {
  Surface const scene =
      together({room(kHalf, by_direction(4)), solid_box({-0.3, -1, -1.2}, {0.3, 1, -1}, plain(kRed))});
  std::vector<NodeMesh> nodes;
  for (Vector3d const& at : {Vector3d(0, 0, 0), Vector3d(1.5, 0, 0.5), Vector3d(-1.5, 0, 0.2)})
    nodes.push_back(mesh_of(capture_cube(scene, at, 48)));
  WalkthroughOptions options;
  options.merged = 1;
  options.filling = 0;
  auto without = renderer_of(nodes, 1, options);
  options.filling = 2;
  auto with_filling = renderer_of(nodes, 1, options);
  Eigen::Isometry3d const pose = look_at({0.5, 0, 0.1}, {0, 0, -2});
  Frame const a = without.render(square_camera(64, 40), pose), b = with_filling.render(square_camera(64, 40), pose);
  EXPECT_GT(gaps(a), 50U);
  EXPECT_LT(gaps(b), gaps(a) / 4);
  EXPECT_EQ(with_filling.uncovered(), gaps(b));
  for (int y = 0; y < a.color.rows; ++y)
    for (int x = 0; x < a.color.cols; ++x) {
      if (a.color(y, x)[3] == 0) continue;
      ASSERT_EQ(a.color(y, x), b.color(y, x));
      ASSERT_EQ(a.depth(y, x), b.depth(y, x));
    }
}

TEST(MergePolicies, PicturesOfAnySizeAreFilled) {
  // Wider than the rasteriser draws at once, with gaps at both ends: as of eight samples a pixel.
  std::vector<NodeMesh> nodes;
  for (double const x : {0.0, 0.1}) {
    CapturedNode node{"000", {x, 0, 0}, {}};
    double const focal = x == 0 ? 40 : 12;
    node.sides.push_back(
        node_side(room(kHalf, plain({0.3, 0.3, 0.3})), square_camera(24, focal), look_at({x, 0, 0}, {x, 0, -1})));
    nodes.push_back(mesh_of(node));
  }
  WalkthroughOptions options;
  options.merged = 1;
  auto renderer = renderer_of(nodes, 1, options);
  Camera const small = Camera::perspective(40, 2, 20, 20, 19.5, 0.5);
  Eigen::Isometry3d const pose = look_at({0.01, 0, 0}, {0.01, 0, -1});
  Frame const coarse = renderer.render(small, pose);
  Frame const fine = renderer.render(small.resized(5000, 250), pose);
  // The same shares of both are covered, but for the pixels of outlines: four columns of the coarse one.
  double const share = double(gaps(fine)) / double(fine.color.total());
  EXPECT_NEAR(share, double(gaps(coarse)) / double(coarse.color.total()), 4.0 / 40);
  EXPECT_LT(share, 0.5);
  for (int const x : {900, 2500, 4100}) EXPECT_EQ(fine.color(125, x)[3], 255) << x;
}

}  // namespace
}  // namespace scanview::test
