#include "synth/dog_shape.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace scanview {
namespace {

using Eigen::Vector3f;

constexpr float kElsewhere = 1e3f;
constexpr float kHeadTurn = 0.30f;
Vector3f const kHeadPivot{0, 82, 26}, kHeadAxis{0.10f, 1, 0.45f};

/// 1 in the middle of a groove, 0 from `half_width` on.
float groove(float distance, float half_width) {
  float const t = 1 - std::min(distance / half_width, 1.0f);
  return t * t * (3 - 2 * t);
}

Vector3f mirrored(Vector3f const& p) { return {std::abs(p.x()), p.y(), p.z()}; }

struct Leg {
  Vector3f hip, ankle, paw;
  float thigh, shin;
};
constexpr int kLegs = 4;
std::array<Leg, kLegs> const kLeg = {{
    {{11, 42, 14}, {12.2f, 9, 19}, {12.5f, 5.4f, 23.5f}, 9.2f, 6.9f},
    {{-11, 42, 14}, {-12.2f, 9, 12.5f}, {-12.5f, 5.4f, 17}, 9.2f, 6.9f},
    {{11, 43, -31}, {12.2f, 9, -39}, {12.5f, 5.4f, -34.5f}, 11.5f, 6.9f},
    {{-11, 43, -31}, {-12.2f, 9, -32.5f}, {-12.5f, 5.4f, -28}, 11.5f, 6.9f},
}};

}  // namespace

Frame3 const& dog_head_frame() {
  static Frame3 const frame(kHeadPivot, kHeadAxis, kHeadTurn);
  return frame;
}

Vector3f dog_from_head(Vector3f const& head) { return Frame3(kHeadPivot, kHeadAxis, -kHeadTurn).local(head); }

Frame3 const& dog_collar_frame() {
  static Frame3 const frame = Frame3::facing({0, 71.5f, 21.5f}, {0, 0.87f, 0.49f});
  return frame;
}

Frame3 const& dog_tag_frame() {
  static Frame3 const frame = Frame3::facing(kDogTag, {0.12f, 0.12f, 1});
  return frame;
}

float dog_torso_distance(Vector3f const& p) {
  Vector3f const q = mirrored(p);
  float d = ellipsoid_distance(q, {0, 51.5f, 12}, {18.5f, 19.5f, 19});
  d = smooth_union(d, ellipsoid_distance(q, {0, 50.5f, -30}, {18.5f, 18.5f, 18.5f}), 16);
  d = smooth_union(d, rod_distance(q, {0, 51.5f, -26}, {0, 52.5f, 8}, 16, 16.5f), 8);
  return smooth_union(d, rod_distance(q, {0, 62, 15}, {0, 84, 28}, 14.5f, 13), 7);
}

float dog_leg_distance(Vector3f const& p, int leg) {
  Leg const& l = kLeg[leg];
  float d = rod_distance(p, l.hip, l.ankle, l.thigh, l.shin);
  d = smooth_union(d, ellipsoid_distance(p, l.paw, {8.2f, 6.6f, 10.2f}), 4);
  for (float toe : {-4.3f, 0.0f, 4.3f})
    d = smooth_union(d, sphere_distance(p, l.paw + Vector3f(toe, -1.2f, 7.2f - 0.05f * toe * toe), 3), 1);
  return d;
}

float dog_tail_distance(Vector3f const& p) {
  float const d = bent_rod_distance(p, {0, 58, -43}, {3, 62, -70}, {9, 92, -56}, 5.6f, 3.2f);
  return smooth_union(d, sphere_distance(p, {9, 92, -56}, 4.2f), 3);
}

float dog_skull_distance(Vector3f const& head) {
  Vector3f const q = mirrored(head);
  float d = ellipsoid_distance(q, {0, 96, 30}, {20.5f, 18.5f, 18.5f});
  d = smooth_union(d, ellipsoid_distance(q, {9.5f, 88.5f, 37}, {11.5f, 10, 11.5f}), 6);        // cheeks
  d = smooth_union(d, rod_distance(q, {0, 89.5f, 44}, {0, 88.5f, 54}, 10.8f, 8.6f), 5);        // snout
  d = smooth_union(d, ellipsoid_distance(q, {4.6f, 85.5f, 55.5f}, {5.6f, 4.8f, 6.2f}), 2.5f);  // lips
  d = smooth_union(d, ellipsoid_distance(q, {0, 80.8f, 48.5f}, {6.4f, 4.2f, 9.5f}), 1.2f);     // jaw
  return smooth_union(d, ellipsoid_distance(q, {8.4f, 105, 43.5f}, {4.6f, 2.2f, 3.4f}), 3);    // brows
}

BladeShape const& dog_left_ear() {
  static BladeShape const ear({{13, 108, 30}, {30, 119, 18}, {25, 77, 22}, 11.5f, 2.1f, 0.2f, 3});
  return ear;
}

BladeShape const& dog_right_ear() {
  static BladeShape const ear({{-13, 104, 25}, {-19, 138, 14}, {-25, 109, 44}, 11.0f, 2.1f, 0.22f, 3});
  return ear;
}

float dog_square_patch_distance(Vector3f const& p) {
  if (p.x() < 5) return kElsewhere;
  Vector3f const q(0, p.y() - 54 + 0.12f * (p.z() + 9), p.z() + 9 - 0.12f * (p.y() - 54));
  return box_distance(q, {50, 8.5f, 10}, 1.6f);
}

float dog_heart_patch_distance(Vector3f const& p) {
  if (p.x() > -5) return kElsewhere;
  float const z = std::abs(p.z() + 10), y = p.y() - 44.5f;
  // Two round lobes over the point where two straight sides meet at a right angle.
  constexpr float kSide = 11.5f;
  float const diagonal = 0.70710678f;
  Vector3f const lobe(0, 1.5f * kSide * diagonal, 0.5f * kSide * diagonal);
  float const u = (y + z) * diagonal, v = (y - z) * diagonal;
  float const square = std::max(std::abs(u - 0.5f * kSide), std::abs(v - 0.5f * kSide)) - 0.5f * kSide;
  return std::min(square, std::hypot(y - lobe.y(), z - lobe.z()) - 0.5f * kSide);
}

float dog_mouth_distance(Vector3f const& head) {
  if (head.z() < 50) return kElsewhere;
  float const x = std::abs(head.x()), y = head.y();
  float const line = y > 84.6f && y < 91 ? x : kElsewhere;
  float const smile = y < 85.2f ? std::abs(std::hypot(x - 4.4f, y - 85.2f) - 4.4f) : kElsewhere;
  return std::min(line, smile);
}

float dog_seam_distance(Vector3f const& p) {
  Vector3f const h = dog_head_frame().local(p);
  if (h.y() > 88) return h.z() < 58 ? std::abs(h.x()) : kElsewhere;
  return p.z() < 40 && (p.z() > -40 || p.y() < 52) ? std::abs(p.x()) : kElsewhere;
}

float dog_hairs(Vector3f const& p) {
  Vector3f const h = dog_head_frame().local(p);
  Vector3f lie(0, -0.3f, -1);
  if (p.y() < 36) lie = {0, -1, -0.1f};
  if (h.y() > 84 && h.z() > 8) lie = {0.3f * (h.x() > 0 ? 1.0f : -1.0f), 0.3f, -1};
  if (std::abs(h.x()) > 20.5f && h.y() > 70) lie = {0, -1, 0.2f};
  if (p.z() < -51) lie = {0, 1, 0.1f};
  lie.normalize();
  Vector3f const q = p - 0.72f * p.dot(lie) * lie;
  return 0.6f * value_noise(q * 1.0f) + 0.4f * value_noise(q * 1.9f + Vector3f::Constant(31));
}

float dog_fur_distance(Vector3f const& p) {
  constexpr float kHeadFillet = 5, kLegFillet = 4, kTailFillet = 3, kEarFillet = 2;
  float d = dog_torso_distance(p);
  for (int leg = 0; leg < kLegs; ++leg) {
    if (rod_distance(p, kLeg[leg].hip, kLeg[leg].paw, 12, 14) < d + kLegFillet)
      d = smooth_union(d, dog_leg_distance(p, leg), kLegFillet);
  }
  if (sphere_distance(p, {4, 76, -54}, 27) < d + kTailFillet) d = smooth_union(d, dog_tail_distance(p), kTailFillet);
  if (sphere_distance(p, dog_from_head({0, 98, 34}), 48) < d + kHeadFillet) {
    Vector3f const h = dog_head_frame().local(p);
    float head = dog_skull_distance(h);
    head = smooth_union(head, dog_left_ear().distance(h), kEarFillet);
    head = smooth_union(head, dog_right_ear().distance(h), kEarFillet);
    if (std::abs(head) < 2) head += 0.45f * groove(dog_mouth_distance(h), 0.6f);
    d = smooth_union(d, head, kHeadFillet);
  }
  d = std::max(d, -p.y());
  if (std::abs(d) > 1.5f) return d;
  float const seam = dog_seam_distance(p);
  d += 0.45f * groove(seam, 0.7f);
  float const patch = std::min(dog_square_patch_distance(p), dog_heart_patch_distance(p));
  float const raised = std::clamp(0.5f - patch / 0.6f, 0.0f, 1.0f);
  float const tufts = p.y() > 0.8f ? 0.16f * dog_hairs(p) : 0.0f;
  return d - 0.55f * raised + (1 - raised) * tufts;
}

}  // namespace scanview
