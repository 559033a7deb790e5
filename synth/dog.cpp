#include "synth/dog.h"

#include <algorithm>
#include <cmath>

#include "synth/assembly.h"
#include "synth/distance_field.h"
#include "synth/dog_paint.h"
#include "synth/dog_shape.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

Vector3f const kBuckle = kDogCollarRadius * Vector3f(0.94f, -0.34f, 0);  // in the collar's frame
Vector3f const kRing{0, 59.6f, 37.9f};                                   // that the tag hangs from

float nose_distance(Vector3f const& p) {
  Vector3f const h = dog_head_frame().local(p);
  float const d = ellipsoid_distance(h, kDogNose, {5.2f, 3.9f, 3.6f});
  // Nostrils.
  return std::max(d, -sphere_distance({std::abs(h.x()), h.y(), h.z()}, kDogNose + Vector3f(2.3f, -0.9f, 3.2f), 1.0f));
}

float eyes_distance(Vector3f const& p) {
  Vector3f const h = dog_head_frame().local(p);
  return sphere_distance({std::abs(h.x()), h.y(), h.z()}, kDogEye, kDogEyeRadius);
}

float tongue_distance(Vector3f const& p) {
  static BladeShape const tongue({{0, 83, 50}, {0, 82.5f, 63}, {0, 75, 61}, 3.6f, 1.1f, 0.4f});
  return tongue.distance(dog_head_frame().local(p));
}

float collar_distance(Vector3f const& p) {
  Vector3f const c = dog_collar_frame().local(p);
  // Thick enough inwards to leave no pocket between it and the neck.
  constexpr float kInwards = 6;
  float const r = std::hypot(c.x(), c.y()) - kDogCollarRadius - 1.3f + 0.5f * kInwards;
  return box_distance({r, c.z(), 0}, {0.5f * kInwards, kDogCollarHalfHeight, 2}, 0.7f);
}

float buckle_distance(Vector3f const& p) {
  static Frame3 const frame = Frame3::facing(kBuckle, kBuckle);
  Vector3f const b = frame.local(dog_collar_frame().local(p));
  float const rim = std::max(box_distance({b.x(), b.y(), 0}, {4.4f, 4.4f, 1}, 1.2f),
                             -box_distance({b.x(), b.y(), 0}, {2.9f, 2.9f, 5}, 0.6f));
  float const prong = std::max(std::abs(b.x()) - 0.6f, std::abs(b.y()) - 3.8f);
  return std::max(std::min(rim, prong), std::abs(b.z() - 1.2f) - 1.0f);
}

float ring_around_x(Vector3f const& p) {
  Vector3f const q = p - kRing;
  return ring_distance({q.y(), q.z(), q.x()}, 2.7f, 0.75f);
}

float tag_distance(Vector3f const& p) {
  Vector3f const t = dog_tag_frame().local(p);
  float const x = std::abs(t.x()), y = std::abs(t.y());
  float outline = std::max(x - kDogTagHalfLength, y - 2.9f);
  outline = smooth_union(outline, std::hypot(x - kDogTagHalfLength - 0.4f, y - 2.5f) - 2.9f, 1);
  outline = smooth_union(outline, std::hypot(t.x(), t.y() - 3.4f) - 2.2f, 1);  // the eye of the tag
  outline = std::max(outline, 1.1f - std::hypot(t.x(), t.y() - 3.7f));
  return std::max(outline, std::abs(t.z()) - 0.95f);
}

Solid part(DogPart name, Vector3f const& center, float radius, float (*distance)(Vector3f const&)) {
  return {center, radius, distance, [name](Vector3f const& p) { return paint_dog(p, name); }};
}

}  // namespace

TriangleMesh make_dog(float spacing_mm, Context& context) {
  std::vector<Solid> const solids = {
      part(DogPart::fur, {0, 55, 0}, 92, dog_fur_distance),
      part(DogPart::collar, {0, 71.5f, 21.5f}, 18, collar_distance),
      part(DogPart::tag, kDogTag, 12, tag_distance),
      part(DogPart::eye, dog_from_head({0, kDogEye.y(), kDogEye.z()}), 13, eyes_distance),
      part(DogPart::tongue, dog_from_head({0, 80, 56}), 13, tongue_distance),
      part(DogPart::nose, dog_from_head(kDogNose), 6, nose_distance),
      part(DogPart::buckle, {0, 71.5f, 21.5f}, 22, buckle_distance),
      part(DogPart::ring, kRing, 4, ring_around_x),
  };
  Eigen::AlignedBox3f const box(Vector3f(-52, -3, -74), Vector3f(48, 138, 80));
  // Bent parts and smooth unions are off by up to a third.
  float const slack = 1.4f;
  return make_assembly(solids, box, spacing_mm, slack, context);
}

}  // namespace scanview
