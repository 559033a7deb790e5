#include "synth/scene_sight.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numbers>

#include "base/error.h"
#include "base/random.h"

namespace scanview {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kInsideDirections = 256;
constexpr float kEnough = 0.999F;  // of a cosine, so that rounding alone does not decide
constexpr double kLift = 1e-5;     // of the radius; single precision places a point to some 1e-7 of it

/// Uniform over all rotations (Shoemake 1992).
Eigen::Matrix3d random_turn(std::uint64_t seed, std::uint64_t item) {
  CounterRandom random(seed, item);
  double const u = random.uniform(), v = 2 * std::numbers::pi * random.uniform(),
               w = 2 * std::numbers::pi * random.uniform();
  return Eigen::Quaterniond(std::sqrt(u) * std::cos(w), std::sqrt(1 - u) * std::sin(v), std::sqrt(1 - u) * std::cos(v),
                            std::sqrt(u) * std::sin(w))
      .toRotationMatrix();
}

/// The i-th of n points that are spread evenly over the unit sphere.
Vector3d spiral_direction(int i, int n) {
  double const y = 1 - (2 * i + 1.0) / n, angle = i * std::numbers::pi * (3 - std::sqrt(5.0));
  double const r = std::sqrt(std::max(0.0, 1 - y * y));
  return {r * std::cos(angle), y, r * std::sin(angle)};
}

}  // namespace

void SightRules::validate() const {
  if (!(least_cosine >= 0 && least_cosine < 1))
    throw Error(ErrorCode::usage, {}, fmt::format("least_cosine is {}, not in 0 .. 1 (without 1)", least_cosine));
  if (!(greatest_coarseness >= 1))
    throw Error(ErrorCode::usage, {}, fmt::format("greatest_coarseness is {}, less than 1", greatest_coarseness));
  if (!(sharp_from >= 0) || !std::isfinite(sharp_from))
    throw Error(ErrorCode::usage, {}, fmt::format("sharp_from is {}, no length", sharp_from));
}

SceneSight::SceneSight(TriangleMesh const& scene, SceneWinding winding)
    : model_(centered(scene)),
      triangles_(scene.triangles),
      winding_(winding),
      rays_(model_.vertices, scene.triangles) {}

Vector3f SceneSight::normal(int triangle) const {
  Eigen::Vector3i const& t = triangles_[static_cast<std::size_t>(triangle)];
  Vector3d const a = model_.vertices[t[0]].cast<double>();
  Vector3d const ab = model_.vertices[t[1]].cast<double>() - a, ac = model_.vertices[t[2]].cast<double>() - a;
  return ab.cross(ac).normalized().cast<float>();
}

Eigen::AlignedBox3d SceneSight::box() const {
  Eigen::AlignedBox3d box;
  for (auto const& t : triangles_)
    for (int const corner : t) box.extend(model_.center + model_.vertices[corner].cast<double>());
  return box;
}

double SceneSight::distance(Vector3d const& place, double farthest) const {
  float const beyond = std::nextafter(static_cast<float>(farthest), std::numeric_limits<float>::infinity());
  return std::min<double>(farthest, rays_.distance(local(place), beyond));
}

std::optional<SceneSight::Surface> SceneSight::first_surface(Vector3d const& origin, Vector3d const& direction) const {
  Vector3f const along = direction.cast<float>();
  RayHit const hit = rays_.first_hit(local(origin), along);
  if (hit.triangle < 0) return std::nullopt;
  bool const ignored = winding_ == SceneWinding::ignored, front = normal(hit.triangle).dot(along) < 0;
  return Surface{hit.distance, ignored || front, ignored || !front};
}

bool SceneSight::is_inside_object(Vector3d const& place) const {
  if (winding_ == SceneWinding::ignored) return false;
  int fronts = 0, backs = 0;
  for (int first = 0; first < kInsideDirections; first += kPacket) {
    RayDirections directions;
    for (int k = 0; k < kPacket; ++k) directions[k] = spiral_direction(first + k, kInsideDirections).cast<float>();
    auto const hits = rays_.first_hits(local(place), directions);
    for (int k = 0; k < kPacket; ++k)
      if (hits[k].triangle >= 0) ++(normal(hits[k].triangle).dot(directions[k]) < 0 ? fronts : backs);
  }
  return backs > fronts;
}

std::vector<SeenPoint> SceneSight::look_around(Vector3d const& eye, int directions, SightRules const& rules,
                                               std::uint64_t seed, std::uint64_t item) const {
  std::vector<SeenPoint> points(static_cast<std::size_t>(directions));
  Eigen::Matrix3d const turn = random_turn(seed, item);
  Vector3f const origin = local(eye);
  auto const lift = static_cast<float>(kLift * radius());
  for (int first = 0; first < directions; first += kPacket) {
    int const count = std::min(directions - first, kPacket);
    RayDirections packet;
    for (int k = 0; k < kPacket; ++k)
      packet[k] = (turn * spiral_direction(first + std::min(k, count - 1), directions)).cast<float>();
    auto const hits = rays_.first_hits(origin, packet);
    for (int k = 0; k < count; ++k) {
      RayHit const& hit = hits[k];
      if (hit.triangle < 0) continue;
      Vector3f facing = normal(hit.triangle);
      float cosine = -facing.dot(packet[k]);
      if (winding_ == SceneWinding::ignored && cosine < 0) {
        facing = -facing;
        cosine = -cosine;
      }
      if (!(cosine > 0)) continue;
      Eigen::Vector3i const& t = triangles_[static_cast<std::size_t>(hit.triangle)];
      Vector3f const on_surface =
          (1 - hit.u - hit.v) * model_.vertices[t[0]] + hit.u * model_.vertices[t[1]] + hit.v * model_.vertices[t[2]];
      SeenPoint& point = points.at(first + k);
      point.position = on_surface + lift * facing;
      point.normal = facing;
      Vector3f const to_point = point.position - origin;
      float const distance = to_point.norm();
      cosine = -kEnough * facing.dot(to_point) / distance;
      point.least_cosine = std::min(static_cast<float>(rules.least_cosine), cosine);
      point.greatest_pitch = static_cast<float>(rules.greatest_coarseness) *
                             std::max(distance, static_cast<float>(rules.sharp_from)) / std::sqrt(cosine);
    }
  }
  return points;
}

std::vector<std::uint64_t> SceneSight::sees(Vector3d const& node, std::vector<SeenPoint> const& points) const {
  std::vector<std::uint64_t> bits((points.size() + 63) / 64);
  std::array<Vector3f, kPacket> origins;
  origins.fill(local(node));
  RayDirections packet;
  packet.fill(Vector3f::UnitX());
  std::array<std::size_t, kPacket> index;
  int count = 0;
  auto const cast = [&] {
    auto const blocked = rays_.occluded(origins, packet, count, 0, 1);
    for (int k = 0; k < count; ++k)
      if (!blocked[k]) bits[index[k] / 64] |= std::uint64_t{1} << (index[k] % 64);
    count = 0;
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    SeenPoint const& point = points[i];
    Vector3f const to_point = point.position - origins[0];
    float const squared = to_point.squaredNorm(), depth = -point.normal.dot(to_point);
    if (!(depth > 0)) continue;
    float const distance = std::sqrt(squared), cosine = depth / distance;
    if (cosine < point.least_cosine || squared > point.greatest_pitch * point.greatest_pitch * cosine) continue;
    packet[count] = to_point;
    index[count] = i;
    if (++count == kPacket) cast();
  }
  if (count > 0) cast();
  return bits;
}

double uncovered_share(SceneSight const& scene, std::vector<Vector3d> const& nodes, Vector3d const& eye, int directions,
                       SightRules const& rules, std::uint64_t seed) {
  auto const points = scene.look_around(eye, directions, rules, seed, 0);
  std::vector<std::uint64_t> left((points.size() + 63) / 64);
  for (std::size_t i = 0; i < points.size(); ++i)
    if (points[i].is_there()) left[i / 64] |= std::uint64_t{1} << (i % 64);
  for (Vector3d const& node : nodes) {
    auto const seen = scene.sees(node, points);
    for (std::size_t w = 0; w < left.size(); ++w) left[w] &= ~seen[w];
  }
  int uncovered = 0;
  for (auto const word : left) uncovered += std::popcount(word);
  return static_cast<double>(uncovered) / directions;
}

}  // namespace scanview
