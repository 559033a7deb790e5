#include "synth/capture_scene.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth/linear_color.h"

namespace scanview {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using Eigen::Vector3i;

constexpr int kDiscSides = 128;
// What the room's lights bring to turntable and backdrop.
constexpr float kDiscLight = 0.95f, kBackdropLight = 0.7f;
constexpr double kOffSurface = 2e-4;  // radii: where rays from a surface start, so that they do not meet it again

std::unique_ptr<RayScene> make_stage(CaptureLayout const& layout) {
  std::vector<Vector3f> vertices = {Vector3f::Zero()};
  std::vector<Vector3i> triangles;
  for (int i = 0; i < kDiscSides; ++i) {
    double const angle = 2 * std::numbers::pi * i / kDiscSides;
    vertices.push_back((layout.disc_radius * Vector3d(std::cos(angle), 0, std::sin(angle))).cast<float>());
    triangles.emplace_back(0, 1 + (i + 1) % kDiscSides, 1 + i);
  }
  // Larger than any picture of it.
  double const z = layout.backdrop_z, half = 20 * (layout.lamp_distance() - z);
  int const first = static_cast<int>(vertices.size());
  for (auto const& [x, y] : {std::pair{-1, -1}, {1, -1}, {1, 1}, {-1, 1}})
    vertices.push_back(Vector3d(x * half, y * half, z).cast<float>());
  triangles.emplace_back(first, first + 1, first + 2);
  triangles.emplace_back(first, first + 2, first + 3);
  return std::make_unique<RayScene>(vertices, triangles);
}

}  // namespace

CaptureScene::CaptureScene(TriangleMesh const& model, CenteredModel const& centered, CaptureLayout const& layout,
                           SceneOptions const& options, Context& context)
    : model_(model),
      centered_(centered),
      layout_(layout),
      options_(options),
      object_(centered.vertices, model.triangles),
      surface_(centered.vertices, model.triangles, model.colors),
      stage_(options.stage ? make_stage(layout) : nullptr),
      paint_(linear_from_hex(options.backdrop)),
      lamp_(layout.room_from_light.translation()),
      lamp_distance_(layout.lamp_distance()) {
  for (auto const& pose : layout.room_from_object)
    model_from_room_.push_back((pose * Eigen::Translation3d(centered.center)).inverse());
  if (stage_)
    for (auto const& pose : model_from_room_) contact_.emplace_back(object_, pose, layout.disc_radius);
  for (int t = 0; t < static_cast<int>(model.triangles.size()); ++t) {
    Vector3f const normal = face_normal(t);
    surface_.mark_seen(t, normal);
    surface_.mark_seen(t, -normal);
  }
  surface_.light(object_, static_cast<float>(centered.radius), context, "light");
}

Vector3f CaptureScene::face_normal(int triangle) const {
  auto const& t = model_.triangles[triangle];
  auto const& v = centered_.vertices;
  return (v[t[1]] - v[t[0]]).cross(v[t[2]] - v[t[0]]).normalized();
}

CaptureScene::ObjectPoint CaptureScene::meet(int view, Vector3d const& eye, Vector3d const& direction) const {
  Isometry3d const& to_model = model_from_room_[view];
  Vector3d const origin = to_model * eye, along = to_model.linear() * direction;
  RayHit const hit = object_.first_hit(origin.cast<float>(), along.cast<float>());
  ObjectPoint result;
  if (hit.triangle < 0) return result;
  result.distance = exact_distance(centered_, model_.triangles[hit.triangle], hit, origin, along);
  result.point = eye + result.distance * direction;
  result.normal = to_model.linear().transpose() * face_normal(hit.triangle).cast<double>();
  if (result.normal.dot(direction) > 0) result.normal = -result.normal;
  return result;
}

bool CaptureScene::is_open_to(int view, ObjectPoint const& point, Vector3d const& place) const {
  Vector3d const way = place - point.point;
  if (!(point.normal.dot(way) > 0)) return false;
  Isometry3d const& to_model = model_from_room_[view];
  double const off = off_surface();
  std::array<Vector3f, kPacket> origins;
  RayDirections directions;
  origins.fill(Vector3f::Zero());
  directions.fill(Vector3f::UnitY());
  origins[0] = (to_model * (point.point + off * point.normal)).cast<float>();
  directions[0] = (to_model.linear() * way.normalized()).cast<float>();
  return !object_.occluded(origins, directions, 1, 0.5f * static_cast<float>(off))[0];
}

double CaptureScene::off_surface() const { return kOffSurface * centered_.radius; }

void CaptureScene::cast_shadows(int view, SceneSamples& samples) const {
  std::array<Vector3f, kPacket> origins;
  RayDirections directions;
  origins.fill(Vector3f::Zero());
  directions.fill(Vector3f::UnitY());
  std::array<int, kPacket> index;
  double const off = off_surface();
  auto const cast = [&](RayScene const& scene, Isometry3d const& from_room) {
    int count = 0;
    for (int i = 0; i < kPacket; ++i) {
      if (!(samples[i].weight + samples[i].gloss > 0)) continue;
      Vector3d const way = (lamp_ - samples[i].point).normalized();
      origins[count] = (from_room * (samples[i].point + off * samples[i].normal)).cast<float>();
      directions[count] = (from_room.linear() * way).cast<float>();
      index[count++] = i;
    }
    if (count == 0) return;
    auto const blocked = scene.occluded(origins, directions, count, 0.5f * static_cast<float>(off));
    for (int k = 0; k < count; ++k)
      if (blocked[k]) samples[index[k]].weight = samples[index[k]].gloss = 0;
  };
  if (view >= 0) cast(object_, model_from_room_[view]);
  if (stage_) cast(*stage_, Isometry3d::Identity());
}

SceneSamples CaptureScene::look(int view, Vector3d const& eye, std::array<Vector3d, kPacket> const& directions,
                                ProjectedLight const& light) const {
  std::array<RayHit, kPacket> object_hits, stage_hits;
  RayDirections cast;
  if (view >= 0) {
    Isometry3d const& to_model = model_from_room_[view];
    for (int i = 0; i < kPacket; ++i) cast[i] = (to_model.linear() * directions[i]).cast<float>();
    object_hits = object_.first_hits((to_model * eye).cast<float>(), cast);
  }
  bool const all_object =
      std::all_of(object_hits.begin(), object_hits.end(), [](RayHit const& hit) { return hit.triangle >= 0; });
  // Nothing of the stage is before the object: it lies on the turntable, and the cameras look down on it.
  if (stage_ && !all_object) {
    for (int i = 0; i < kPacket; ++i) cast[i] = directions[i].cast<float>();
    stage_hits = stage_->first_hits(eye.cast<float>(), cast);
  }

  SceneSamples samples;
  for (int i = 0; i < kPacket; ++i) {
    SceneSample& sample = samples[i];
    sample.is_object = object_hits[i].triangle >= 0;
    RayHit const& hit = sample.is_object ? object_hits[i] : stage_hits[i];
    if (hit.triangle < 0) continue;
    sample.point = eye + static_cast<double>(hit.distance) * directions[i];
    if (sample.is_object)
      look_at_object(sample, hit, directions[i], view);
    else
      look_at_stage(sample, hit, directions[i], view);
    if (sample.weight + sample.gloss > 0) sample.light = light.at(sample.point);
  }
  cast_shadows(view, samples);
  return samples;
}

void CaptureScene::look_at_object(SceneSample& sample, RayHit const& hit, Vector3d const& direction, int view) const {
  Eigen::Matrix3d const& to_model = model_from_room_[view].linear();
  Vector3f const along = (to_model * direction).cast<float>();
  sample.normal = to_model.transpose() * face_normal(hit.triangle).cast<double>();
  if (sample.normal.dot(direction) > 0) sample.normal = -sample.normal;
  sample.albedo = luminance(surface_.paint().at(hit));
  sample.room = surface_.leaving(hit, along);
  Vector3d const to_lamp = lamp_ - sample.point;
  if (sample.normal.dot(to_lamp) <= 0) return;
  Vector3d const normal = to_model.transpose() * surface_.normal(hit, along).cast<double>();
  double const distance = to_lamp.norm(), cosine = normal.dot(to_lamp) / distance;
  if (cosine <= 0) return;
  double const arriving = cosine * lamp_distance_ / distance;
  sample.weight = static_cast<float>(sample.albedo * arriving);
  if (options_.gloss > 0) {
    Vector3d const half = (to_lamp / distance - direction.normalized()).normalized();
    double const m = options_.gloss_exponent;
    sample.gloss =
        static_cast<float>(options_.gloss * (m + 8) / 8 * std::pow(std::max(0.0, normal.dot(half)), m) * arriving);
  }
}

void CaptureScene::look_at_stage(SceneSample& sample, RayHit const& hit, Vector3d const& direction, int view) const {
  bool const is_disc = hit.triangle < kDiscSides;
  sample.normal = is_disc ? Vector3d::UnitY() : Vector3d::UnitZ();
  if (sample.normal.dot(direction) > 0) sample.normal = -sample.normal;
  sample.albedo = luminance(paint_);
  sample.room = paint_ * (is_disc ? kDiscLight : kBackdropLight);
  if (is_disc && view >= 0) sample.room *= contact_[view].at(sample.point.x(), sample.point.z());
  Vector3d const to_lamp = lamp_ - sample.point;
  double const distance = to_lamp.norm(), cosine = sample.normal.dot(to_lamp) / distance;
  if (cosine > 0) sample.weight = static_cast<float>(sample.albedo * cosine * lamp_distance_ / distance);
}

}  // namespace scanview
