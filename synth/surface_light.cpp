#include "synth/surface_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/parallel.h"
#include "base/srgb.h"

namespace scanview {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr std::size_t kDirections = 6 * kPacket;
constexpr std::size_t kChunk = 1 << 10;  // shading points a task
cv::Vec3b const kPlaster(205, 214, 222);
constexpr float kCreaseCos = 0.766f;  // cos 40°

/// A direction light comes from, and how much of it.
struct Source {
  Vector3f direction, radiance;
};

Vector3f radiance_from(Vector3f const& direction) {
  Vector3f const key = Vector3f(0.50f, 0.72f, 0.95f).normalized();
  float const up = 0.5f + 0.5f * direction.y();
  Vector3f const ground(0.50f, 0.45f, 0.40f), sky(0.76f, 0.80f, 0.86f);
  Vector3f const lamp = Vector3f(1.25f, 1.17f, 1.04f) * std::exp(6.0f * (direction.dot(key) - 1.0f));
  return ground + (sky - ground) * up + lamp;
}

/// Equal areas of the sphere (Fibonacci spiral), scaled so that only the most brightly lit white is clipped.
std::vector<Source> light_sources() {
  std::vector<Source> sources(kDirections);
  double const golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (std::size_t i = 0; i < kDirections; ++i) {
    double const y = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / kDirections;
    double const r = std::sqrt(1.0 - y * y), a = golden * static_cast<double>(i);
    sources[i].direction = Eigen::Vector3d(r * std::cos(a), y, r * std::sin(a)).cast<float>();
    sources[i].radiance = radiance_from(sources[i].direction);
  }
  // Packets of rays are faster where they stay together: octants of the sphere in turn.
  auto const octant = [](Source const& s) {
    return (s.direction.x() < 0) + 2 * (s.direction.y() < 0) + 4 * (s.direction.z() < 0);
  };
  std::stable_sort(sources.begin(), sources.end(),
                   [&](Source const& a, Source const& b) { return octant(a) < octant(b); });
  float brightest = 0;
  for (Source const& normal : sources) {
    Vector3f sum = Vector3f::Zero();
    for (Source const& s : sources) sum += s.radiance * std::max(0.0f, s.direction.dot(normal.direction));
    brightest = std::max(brightest, sum.maxCoeff());
  }
  for (Source& s : sources) s.radiance *= 1.06f / brightest;
  return sources;
}

Vector3f irradiance(Vector3f const& position, Vector3f const& normal, std::vector<Source> const& sources,
                    RayScene const& scene, float radius) {
  Vector3f sum = Vector3f::Zero();
  std::array<Vector3f, kPacket> origins;
  origins.fill(position + 5e-4f * radius * normal);
  RayDirections directions;
  directions.fill(normal);
  std::array<Vector3f, kPacket> arriving;
  int count = 0;
  auto const cast = [&] {
    auto const blocked = scene.occluded(origins, directions, count, 2e-3f * radius);
    for (int i = 0; i < count; ++i)
      if (!blocked[i]) sum += arriving[i];
    count = 0;
  };
  for (Source const& source : sources) {
    float const cosine = source.direction.dot(normal);
    if (cosine <= 0) continue;
    directions[count] = source.direction;
    arriving[count++] = cosine * source.radiance;
    if (count == kPacket) cast();
  }
  if (count > 0) cast();
  return sum;
}

}  // namespace

SurfaceLight::SurfaceLight(std::vector<Vector3f> const& vertices, std::vector<Vector3i> const& triangles,
                           std::vector<cv::Vec3b> const& colors)
    : vertices_(vertices), triangles_(triangles), colors_(colors), corners_(triangles) {
  gather_points();
  for (int side : {front, back}) {
    seen_[side] = std::vector<std::atomic<bool>>(points_.size());
    light_[side].assign(points_.size(), Vector3f::Zero());
  }
}

void SurfaceLight::gather_points() {
  points_.resize(vertices_.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i) points_[i].vertex = static_cast<int>(i);
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    Vector3i const& v = triangles_[t];
    Vector3f const area = (vertices_[v[1]] - vertices_[v[0]]).cross(vertices_[v[2]] - vertices_[v[0]]);
    float const length = area.norm();
    if (!(length > 0)) continue;  // no side to shade
    Vector3f const unit = area / length;
    for (int c = 0; c < 3; ++c) {
      int at = v[c];
      auto const fits = [&] {
        return points_[at].face_normal.isZero(0) || points_[at].face_normal.dot(unit) >= kCreaseCos;
      };
      while (!fits() && points_[at].next >= 0) at = points_[at].next;
      if (!fits()) {
        points_[at].next = static_cast<int>(points_.size());
        at = points_[at].next;
        points_.push_back({v[c], Vector3f::Zero(), Vector3f::Zero(), -1});
      }
      if (points_[at].face_normal.isZero(0)) points_[at].face_normal = unit;
      points_[at].normal_sum += area;
      corners_[t][c] = at;
    }
  }
}

SurfaceLight::Side SurfaceLight::side_seen(int triangle, Vector3f const& direction) const {
  Vector3i const& t = triangles_[triangle];
  Vector3f const normal = (vertices_[t[1]] - vertices_[t[0]]).cross(vertices_[t[2]] - vertices_[t[0]]);
  return normal.dot(direction) < 0 ? front : back;
}

void SurfaceLight::mark_seen(int triangle, Vector3f const& direction) {
  auto& seen = seen_[side_seen(triangle, direction)];
  for (int c = 0; c < 3; ++c) {
    auto& mark = seen[corners_[triangle][c]];
    if (!mark.load(std::memory_order_relaxed)) mark.store(true, std::memory_order_relaxed);  // keeps cache lines shared
  }
}

void SurfaceLight::light(RayScene const& scene, float radius, Context& context) {
  std::vector<Source> const sources = light_sources();
  std::array<float, 256> linear;
  for (int i = 0; i < 256; ++i) linear[i] = static_cast<float>(linear_from_srgb(i / 255.0));
  auto const light_chunk = [&](std::size_t chunk) {
    std::size_t const end = std::min(points_.size(), (chunk + 1) * kChunk);
    for (std::size_t i = chunk * kChunk; i < end; ++i) {
      if (points_[i].normal_sum.isZero(0)) continue;  // of degenerate triangles only
      cv::Vec3b const bgr = colors_.empty() ? kPlaster : colors_[points_[i].vertex];
      Vector3f const albedo(linear[bgr[2]], linear[bgr[1]], linear[bgr[0]]);
      Vector3f const normal = points_[i].normal_sum.normalized();
      for (int side : {front, back}) {
        if (!seen_[side][i].load(std::memory_order_relaxed)) continue;
        Vector3f const outward = side == front ? normal : Vector3f(-normal);
        light_[side][i] =
            albedo.cwiseProduct(irradiance(vertices_[points_[i].vertex], outward, sources, scene, radius));
      }
    }
  };
  for_each_index(context, (points_.size() + kChunk - 1) / kChunk, light_chunk, "light");
}

Vector3f SurfaceLight::leaving(RayHit const& hit, Vector3f const& direction) const {
  auto const& light = light_[side_seen(hit.triangle, direction)];
  Vector3i const& c = corners_[hit.triangle];
  return (1 - hit.u - hit.v) * light[c[0]] + hit.u * light[c[1]] + hit.v * light[c[2]];
}

Vector3f SurfaceLight::normal(RayHit const& hit, Vector3f const& direction) const {
  Vector3i const& c = corners_[hit.triangle];
  auto const at = [&](int i) { return points_[c[i]].normal_sum.normalized(); };
  Vector3f const smooth = ((1 - hit.u - hit.v) * at(0) + hit.u * at(1) + hit.v * at(2)).normalized();
  return side_seen(hit.triangle, direction) == front ? smooth : Vector3f(-smooth);
}

Vector3f SurfaceLight::albedo(RayHit const& hit) const {
  static std::array<float, 256> const linear = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = static_cast<float>(linear_from_srgb8()[i]);
    return table;
  }();
  Vector3i const& t = triangles_[hit.triangle];
  auto const at = [&](int i) {
    cv::Vec3b const bgr = colors_.empty() ? kPlaster : colors_[t[i]];
    return Vector3f(linear[bgr[2]], linear[bgr[1]], linear[bgr[0]]);
  };
  return (1 - hit.u - hit.v) * at(0) + hit.u * at(1) + hit.v * at(2);
}

}  // namespace scanview
