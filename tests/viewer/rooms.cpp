#include "viewer/rooms.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/srgb.h"

namespace scanview::test {
namespace {

using Eigen::Vector3d;

cv::Vec3b bytes_of(Vector3d const& linear) {
  cv::Vec3b bytes;
  for (int c = 0; c < 3; ++c) bytes[c] = cv::saturate_cast<uchar>(255 * srgb_from_linear(linear[2 - c]));
  return bytes;
}

}  // namespace

Paint plain(Vector3d const& color) {
  return [=](Vector3d const&) { return color; };
}

Paint by_direction(double waves) {
  return [=](Vector3d const& p) -> Vector3d {
    Vector3d const d = p.normalized();
    return {0.5 + 0.3 * std::sin(waves * d.x()), 0.5 + 0.3 * std::sin(waves * d.y() + 1),
            0.5 + 0.3 * std::sin(waves * d.z() + 2)};
  };
}

Surface inside_of(std::vector<Wall> const& walls, Paint const& paint) {
  return [=](Vector3d const& origin, Vector3d const& direction) -> std::optional<Hit> {
    double nearest = INFINITY;
    for (Wall const& wall : walls) {
      double const towards = wall.normal.dot(direction);
      if (towards > 0) nearest = std::min(nearest, (wall.offset - wall.normal.dot(origin)) / towards);
    }
    if (!(nearest > 0 && std::isfinite(nearest))) return std::nullopt;
    return Hit{nearest, paint(origin + nearest * direction)};
  };
}

std::vector<Wall> box_walls(Vector3d const& low, Vector3d const& high) {
  std::vector<Wall> walls;
  for (int c = 0; c < 3; ++c) {
    walls.push_back({Vector3d::Unit(c), high[c]});
    walls.push_back({-Vector3d::Unit(c), -low[c]});
  }
  return walls;
}

std::vector<Wall> slanted_walls() {
  std::vector<Wall> walls;
  for (int i = 0; i < 8; ++i) {
    double const a = 0.3 + i * std::numbers::pi / 4;
    walls.push_back({Vector3d(std::cos(a), 0.2 * (i % 3 - 1), std::sin(a)).normalized(), 2 + 0.1 * i});
  }
  walls.push_back({Vector3d(0.1, 1, 0.2).normalized(), 1.5});
  walls.push_back({Vector3d(0.15, -1, -0.1).normalized(), 1.2});
  return walls;
}

Surface room(double half, Paint const& paint) {
  return inside_of(box_walls(Vector3d::Constant(-half), Vector3d::Constant(half)), paint);
}

Surface globe(Vector3d const& center, double radius, Paint const& paint) {
  return [=](Vector3d const& origin, Vector3d const& direction) -> std::optional<Hit> {
    Vector3d const from_center = origin - center;
    double const a = direction.squaredNorm(), b = from_center.dot(direction),
                 c = from_center.squaredNorm() - radius * radius;
    if (b * b - a * c < 0) return std::nullopt;
    double const t = (-b + std::sqrt(b * b - a * c)) / a;
    if (!(t > 0)) return std::nullopt;
    return Hit{t, paint(origin + t * direction)};
  };
}

Surface solid_box(Vector3d const& low, Vector3d const& high, Paint const& paint) {
  return [=](Vector3d const& origin, Vector3d const& direction) -> std::optional<Hit> {
    double enter = -INFINITY, leave = INFINITY;
    for (int c = 0; c < 3; ++c) {
      if (direction[c] == 0) {
        if (origin[c] < low[c] || origin[c] > high[c]) return std::nullopt;
        continue;
      }
      auto const [near, far] = std::minmax({(low[c] - origin[c]) / direction[c], (high[c] - origin[c]) / direction[c]});
      enter = std::max(enter, near);
      leave = std::min(leave, far);
    }
    if (!(enter > 0 && enter <= leave)) return std::nullopt;
    return Hit{enter, paint(origin + enter * direction)};
  };
}

View node_side(Surface const& surface, Camera const& camera, Eigen::Isometry3d const& scene_from_camera,
               Paint const& sky) {
  View view;
  view.object_from_camera = scene_from_camera;
  RangeImage& image = view.image = empty_range_image(camera);
  image.color.create(camera.height(), camera.width());
  for (int y = 0; y < camera.height(); ++y)
    for (int x = 0; x < camera.width(); ++x) {
      Vector3d const direction = scene_from_camera.linear() * camera.ray_direction(x, y);
      auto const hit = surface(scene_from_camera.translation(), direction);
      image.color(y, x) = bytes_of(hit ? hit->color : sky(direction));
      image.classes(y, x) = static_cast<uchar>(hit ? PixelClass::object : PixelClass::background);
      if (!hit) continue;
      image.depth(y, x) = float(hit->t);
      image.sigma(y, x) = float(1e-6 * hit->t);
    }
  return view;
}

CapturedNode capture_cube(Surface const& surface, Vector3d const& position, int size, Paint const& sky) {
  CapturedNode node{"000", position, {}};
  for (int side = 0; side < kCubeSides; ++side) {
    node.sides.push_back(node_side(surface, cube_side_camera(size), scene_from_cube_side(side, position), sky));
    node.sides.back().name = cube_side_name(side);
  }
  return node;
}

NodeMesh mesh_of(CapturedNode const& node, NodeMeshOptions const& options) {
  Context context;
  NodeMesh mesh = mesh_node(node, options, context);
  mesh.check();
  return mesh;
}

WalkthroughRenderer renderer_of(std::vector<NodeMesh> const& nodes, double walking_radius,
                                WalkthroughOptions const& options, NodeQuality quality) {
  WalkthroughOptions of_quality = options;
  of_quality.quality = quality;
  return WalkthroughRenderer(make_node_library(nodes, walking_radius, quality), of_quality);
}

Vector3d random_direction(CounterRandom& random) {
  return Vector3d(random.normal(), random.normal(), random.normal()).normalized();
}

Eigen::Isometry3d random_look(Vector3d const& eye, CounterRandom& random) {
  Vector3d const to = random_direction(random);
  return look_at(eye, eye + to, to.cross(random_direction(random)).normalized());
}

std::optional<TriangleHit> meet(NodeMesh const& mesh, Vector3d const& origin, Vector3d const& direction) {
  std::optional<TriangleHit> nearest;
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    // origin + s d = Σ wᵢ pᵢ, Σ wᵢ = 1
    Eigen::Matrix4d m;
    for (int i = 0; i < 3; ++i) {
      m.col(i).head<3>() = mesh.position + mesh.vertices[mesh.triangles[t][i]].cast<double>();
      m(3, i) = 1;
    }
    m.col(3) << -direction, 0;
    Eigen::Vector4d const solved = m.partialPivLu().solve(Eigen::Vector4d(origin.x(), origin.y(), origin.z(), 1));
    if (!(solved.head<3>().minCoeff() >= -1e-9 && solved[3] > 0)) continue;
    if (!nearest || solved[3] < nearest->t) nearest = TriangleHit{t, solved.head<3>(), solved[3]};
  }
  return nearest;
}

Camera square_camera(int size, double focal) {
  return Camera::perspective(size, size, focal, focal, 0.5 * (size - 1), 0.5 * (size - 1));
}

std::size_t gaps(Frame const& frame) { return frame.color.total() - drawn_pixels(frame.color); }

double true_depth(Surface const& surface, Camera const& camera, Eigen::Isometry3d const& pose, int x, int y) {
  auto const hit = surface(pose.translation(), pose.linear() * camera.ray_direction(x, y));
  return hit ? hit->t : 0;
}

}  // namespace scanview::test
