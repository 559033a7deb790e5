#include "synth/surface_light.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

#include "base/parallel.h"

namespace scanview {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr std::size_t kChunk = 1 << 10;        // shading points a task
Vector3f const kFillTint(1.0f, 0.97f, 0.92f);  // walls are warmer than the sky
constexpr float kCreaseCos = 0.766f;           // cos 40°

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
std::vector<Source> light_sources(int directions) {
  std::vector<Source> sources(directions);
  double const golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  for (std::size_t i = 0; i < sources.size(); ++i) {
    double const y = 1.0 - (2.0 * static_cast<double>(i) + 1.0) / directions;
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

/// What light falls on, and how much.
struct LitPoint {
  Vector3f position, normal;
  Vector3f irradiance = Vector3f::Zero();
  Vector3f* result = nullptr;  ///< where it belongs
};

/// The open sky and what blocks it.
class Surroundings {
 public:
  Surroundings(RayScene const& scene, float radius, SurfaceLightOptions const& options)
      : scene_(scene), radius_(radius), options_(options), sources_(light_sources(options.directions)) {
    Vector3f sum = Vector3f::Zero();
    for (Source const& source : sources_) sum += source.radiance;
    fill_ = options.fill / static_cast<float>(sources_.size()) * sum.cwiseProduct(kFillTint);
  }

  /// Of up to kPacket points: rays of one direction from neighbours take the same way, and are cast together.
  void irradiate(std::span<LitPoint> points) const {
    for (Source const& source : sources_) {
      std::array<Vector3f, kPacket> origins;
      std::array<LitPoint*, kPacket> lit;
      int count = 0;
      for (LitPoint& point : points) {
        if (source.direction.dot(point.normal) <= 0) continue;
        origins[count] = point.position + 5e-4f * radius_ * point.normal;
        lit[count++] = &point;
      }
      if (count == 0) continue;
      auto const distances = blocked_at(origins, source.direction, count);
      for (int i = 0; i < count; ++i) {
        float const cosine = source.direction.dot(lit[i]->normal);
        if (distances[i] == kOpen)
          lit[i]->irradiance += cosine * source.radiance;
        else if (options_.fill > 0)
          lit[i]->irradiance += cosine * distances[i] / (distances[i] + options_.fill_reach) * fill_;
      }
    }
    for (LitPoint& point : points) point.irradiance *= options_.exposure;
  }

 private:
  static constexpr float kOpen = std::numeric_limits<float>::infinity();

  /// How far each ray comes; where that is not asked for, 0 or kOpen.
  std::array<float, kPacket> blocked_at(std::array<Vector3f, kPacket> const& origins, Vector3f const& direction,
                                        int count) const {
    float const nearest = 2e-3f * radius_;
    RayDirections directions;
    directions.fill(direction);
    std::array<float, kPacket> distances{};
    if (options_.fill > 0) {
      auto const hits = scene_.first_hits(origins, directions, count, nearest);
      for (int i = 0; i < count; ++i) distances[i] = hits[i].triangle < 0 ? kOpen : hits[i].distance;
    } else {
      auto const blocked = scene_.occluded(origins, directions, count, nearest);
      for (int i = 0; i < count; ++i) distances[i] = blocked[i] ? 0 : kOpen;
    }
    return distances;
  }

  RayScene const& scene_;
  float radius_;
  SurfaceLightOptions const& options_;
  std::vector<Source> sources_;
  Vector3f fill_;  // from each direction that a far surface blocks
};

}  // namespace

SurfaceLight::SurfaceLight(std::vector<Vector3f> const& vertices, std::vector<Vector3i> const& triangles,
                           SurfacePaint const& paint, SurfaceLightOptions const& options)
    : vertices_(vertices), triangles_(triangles), paint_(paint), options_(options), corners_(triangles) {
  gather_points();
  has_new_ = std::vector<std::atomic<bool>>((points_.size() + kChunk - 1) / kChunk);
  for (int side : {front, back}) {
    states_[side] = std::vector<std::atomic<State>>(points_.size());
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
  auto& states = states_[side_seen(triangle, direction)];
  for (int c = 0; c < 3; ++c) {
    std::size_t const point = corners_[triangle][c];
    if (states[point].load(std::memory_order_relaxed) != State::unseen) continue;  // keeps cache lines shared
    states[point].store(State::seen, std::memory_order_relaxed);
    has_new_[point / kChunk].store(true, std::memory_order_relaxed);
  }
}

bool SurfaceLight::is_lit(int triangle, Vector3f const& direction) const {
  auto const& states = states_[side_seen(triangle, direction)];
  for (int c = 0; c < 3; ++c)
    if (states[corners_[triangle][c]].load(std::memory_order_relaxed) != State::lit) return false;
  return true;
}

void SurfaceLight::light(RayScene const& scene, float radius, Context& context, std::string const& stage) {
  std::vector<std::size_t> chunks;
  for (std::size_t chunk = 0; chunk < has_new_.size(); ++chunk)
    if (has_new_[chunk].load(std::memory_order_relaxed)) chunks.push_back(chunk);
  if (chunks.empty()) return;
  Surroundings const surroundings(scene, radius, options_);
  auto const light_chunk = [&](std::size_t task) {
    std::size_t const chunk = chunks[task], end = std::min(points_.size(), (chunk + 1) * kChunk);
    std::vector<LitPoint> points;
    for (int side : {front, back})
      for (std::size_t i = chunk * kChunk; i < end; ++i) {
        if (states_[side][i].load(std::memory_order_relaxed) != State::seen) continue;
        states_[side][i].store(State::lit, std::memory_order_relaxed);
        if (points_[i].normal_sum.isZero(0)) continue;  // of degenerate triangles only
        Vector3f const normal = (side == front ? 1.0f : -1.0f) * points_[i].normal_sum.normalized();
        points.push_back({vertices_[points_[i].vertex], normal, Vector3f::Zero(), &light_[side][i]});
      }
    for (std::size_t first = 0; first < points.size(); first += kPacket)
      surroundings.irradiate(std::span(points).subspan(first, std::min<std::size_t>(kPacket, points.size() - first)));
    for (LitPoint const& point : points) *point.result = point.irradiance;
    has_new_[chunk].store(false, std::memory_order_relaxed);
  };
  for_each_index(context, chunks.size(), light_chunk, stage);
}

Vector3f SurfaceLight::leaving(RayHit const& hit, Vector3f const& direction) const {
  auto const& light = light_[side_seen(hit.triangle, direction)];
  Vector3i const &c = corners_[hit.triangle], &t = triangles_[hit.triangle];
  if (paint_.has_texture(hit.triangle)) {
    Vector3f const arriving = (1 - hit.u - hit.v) * light[c[0]] + hit.u * light[c[1]] + hit.v * light[c[2]];
    return paint_.at(hit).cwiseProduct(arriving);
  }
  auto const at = [&](int i) -> Vector3f { return paint_.at_vertex(t[i]).cwiseProduct(light[c[i]]); };
  return (1 - hit.u - hit.v) * at(0) + hit.u * at(1) + hit.v * at(2);
}

Vector3f SurfaceLight::normal(RayHit const& hit, Vector3f const& direction) const {
  Vector3i const& c = corners_[hit.triangle];
  auto const at = [&](int i) { return points_[c[i]].normal_sum.normalized(); };
  Vector3f const smooth = ((1 - hit.u - hit.v) * at(0) + hit.u * at(1) + hit.v * at(2)).normalized();
  return side_seen(hit.triangle, direction) == front ? smooth : Vector3f(-smooth);
}

}  // namespace scanview
