#include "synth/statuette.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth/assembly.h"
#include "synth/distance_field.h"
#include "synth/statuette_paint.h"
#include "synth/statuette_plan.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

float torso_distance(Vector3f const& p) {
  Vector3f const q(std::abs(p.x()), p.y(), p.z());
  float d = ellipsoid_distance(q, {0, 27, -9}, {18, 15.5f, 17});
  d = smooth_union(d, rod_distance(q, {0, 34, -6}, {0, 57, 4.5f}, 14.5f, 10.5f), 8);
  d = smooth_union(d, ellipsoid_distance(q, {14.5f, 23, -3}, {7.5f, 11, 13.5f}), 4);      // haunches
  d = smooth_union(d, ellipsoid_distance(q, {16.5f, 14.6f, 10}, {5.4f, 3.9f, 9}), 2.5f);  // hind feet
  float leg = rod_distance(q, {7, 46, 9}, {7.6f, 17, 17.5f}, 5.6f, 3.7f);
  leg = smooth_union(leg, ellipsoid_distance(q, {7.9f, 15.2f, 20.5f}, {4.9f, 4.2f, 6.6f}), 2);
  for (float toe : {6.2f, 9.6f}) leg = smooth_union(leg, sphere_distance(q, {toe, 14.4f, 25.6f}, 2.1f), 1.2f);
  return smooth_union(d, leg, 3.5f);
}

float tail_distance(Vector3f const& p) {
  return bent_rod_distance(p, {0, 19, -23}, {14, 22, -48}, {15, 47, -30}, 3.6f, 1.7f);
}

/// In the head's own frame (head_frame()), where it looks along +z.
float head_distance(Vector3f const& h) {
  Vector3f const q(std::abs(h.x()), h.y(), h.z());
  float d = ellipsoid_distance(q, {0, 77, 9}, {15, 14, 14});
  d = smooth_union(d, ellipsoid_distance(q, {7, 70, 14}, {8.5f, 8, 9}), 5);                 // cheeks
  d = smooth_union(d, rod_distance(q, {0, 71.5f, 19}, {0, 71, 27}, 8, 5.8f), 4);            // snout
  d = smooth_union(d, ellipsoid_distance(q, {6.2f, 86.4f, 18.2f}, {3.6f, 1.6f, 2.4f}), 2);  // brows
  d = std::min(d, sphere_distance(q, {kEye.x(), kEye.y(), kEye.z()}, kEyeRadius));
  return smooth_union(d, ear_distance(q), 2.5f);
}

float collar_distance(Vector3f const& p) {
  static Frame3 const frame = Frame3::facing({0, 60.2f, 5.6f}, {0, 1, 0.28f});
  Vector3f const c = frame.local(p);
  return ring_distance(c, 10.9f, 2.1f);
}

float tag_distance(Vector3f const& p) {
  static Frame3 const frame = Frame3::facing(kTag, {0, 0.35f, 1});
  Vector3f const t = frame.local(p);
  float const r = std::hypot(t.x(), t.y());
  float const disc = std::max(r - 4.3f, std::abs(t.z()) - 0.9f);
  float const hole = 1.1f - std::hypot(t.x(), t.y() - 2.5f);
  return std::max(disc, hole);
}

float flower_distance(Vector3f const& f) {
  float const r = std::hypot(f.x(), f.y());
  if (r > 25 || std::abs(f.z()) > 20) return std::max(r - 14, std::abs(f.z()) - 6);
  float const sector = 2 * std::numbers::pi_v<float> / kPetals;
  float const around = std::atan2(f.y(), f.x());
  float const turn = around - sector * std::round(around / sector);
  Vector3f const q(r * std::cos(turn), r * std::sin(turn), f.z() - 0.018f * r * r);
  return ellipsoid_distance(q, {7.6f, 0, 0}, {5.0f, 3.0f, 0.95f});
}

float leaf_distance(Vector3f const& p, Frame3 const& frame) {
  Vector3f const l = frame.local(p);
  return ellipsoid_distance({l.x(), l.y() + 0.012f * l.x() * l.x(), l.z()}, {0, 0, 0}, {9, 0.95f, 3.6f});
}

float plinth_distance(Vector3f const& p) {
  float const d = disc_distance(p, kPlinthRadius, 0, kPlinthTop, 1.2f);
  float const r = std::hypot(p.x(), p.z());
  float const upper = std::hypot(r - kPlinthRadius, p.y() - 10.2f) - 0.7f;
  float const lower = std::hypot(r - kPlinthRadius, p.y() - 1.8f) - 0.7f;
  return std::max(d, -std::min(upper, lower));
}

float stem_distance(Vector3f const& p) {
  return bent_rod_distance(p, {25, 10, 12}, {29, 30, 13}, kFlower - Vector3f(0.5f, 0.3f, 1.2f), 1.35f, 1.15f);
}

float leaves_distance(Vector3f const& p) {
  static Frame3 const left = leaf_frame(0), right = leaf_frame(1);
  return std::min(leaf_distance(p, left), leaf_distance(p, right));
}

float dog_distance(Vector3f const& p) {
  float d = torso_distance(p);
  constexpr float kTailFillet = 3, kHeadFillet = 5;
  if (sphere_distance(p, {8, 32, -33}, 24) < d + kTailFillet) d = smooth_union(d, tail_distance(p), kTailFillet);
  if (sphere_distance(p, {0, 76, 10}, 32) < d + kHeadFillet)
    d = smooth_union(d, head_distance(head_frame().local(p)), kHeadFillet);
  return d;
}
float nose_distance(Vector3f const& p) {
  return ellipsoid_distance(head_frame().local(p), {0, 75, 32}, {3.7f, 2.7f, 2.6f});
}
float tongue_distance(Vector3f const& p) {
  Vector3f const h = head_frame().local(p);
  return ellipsoid_distance({h.x(), h.y() + 0.05f * (h.z() - 30) * (h.z() - 30), h.z()}, {0, 65.6f, 30.2f},
                            {2.6f, 1.1f, 4.2f});
}
float blossom_distance(Vector3f const& p) { return flower_distance(flower_frame().local(p)); }
float button_distance(Vector3f const& p) {
  return ellipsoid_distance(flower_frame().local(p), {0, 0, 0.6f}, {3.7f, 3.7f, 2.2f});
}
float hoop_distance(Vector3f const& p) { return ring_distance(hoop_frame().local(p), kHoopMajor, kHoopMinor); }
float ladybird_distance(Vector3f const& p) {
  return ellipsoid_distance(ladybird_frame().local(p), {0, 0, 0}, {2.6f, 2.0f, 3.2f});
}

Solid part(StatuettePart name, Vector3f const& center, float radius, float (*distance)(Vector3f const&)) {
  return {center, radius, distance, [name](Vector3f const& p) { return paint_statuette(p, name); }};
}

std::vector<Solid> parts() {
  return {
      part(StatuettePart::plinth, {0, 6, 0}, 40, plinth_distance),
      part(StatuettePart::dog, {0, 52, 0}, 62, dog_distance),
      part(StatuettePart::nose, head_frame_inverse({0, 75, 32}), 4, nose_distance),
      part(StatuettePart::tongue, head_frame_inverse({0, 65, 30}), 5, tongue_distance),
      part(StatuettePart::collar, {0, 60.2f, 5.6f}, 14, collar_distance),
      part(StatuettePart::tag, kTag, 5, tag_distance),
      part(StatuettePart::hoop, kHoop, 17, hoop_distance),
      part(StatuettePart::stem, {27, 30, 14}, 24, stem_distance),
      part(StatuettePart::leaf, {28, 25, 14}, 20, leaves_distance),
      part(StatuettePart::petals, kFlower, 15, blossom_distance),
      part(StatuettePart::button, kFlower, 5, button_distance),
      part(StatuettePart::ladybird, kLadybird, 4, ladybird_distance),
  };
}

}  // namespace

TriangleMesh make_statuette(float spacing_mm, Context& context) {
  Eigen::AlignedBox3f const box(Vector3f(-44, -3, -46), Vector3f(46, 107, 44));
  // Bent parts overestimate the distance by up to a tenth.
  float const slack = 1.25f;
  return make_assembly(parts(), box, spacing_mm, slack, context);
}

}  // namespace scanview
