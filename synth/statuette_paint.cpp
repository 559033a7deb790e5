#include "synth/statuette_paint.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

Vector3f paint_plinth_side(Vector3f const& p) {
  static Lettering const words("scanview");
  float const angle = std::atan2(p.x(), p.z());  // 0 in front
  float const along = angle * kPlinthRadius;
  // Between two grooves a blue band that slowly changes its hue around the plinth, so that every side is its own.
  float const round = 0.5f + 0.5f * std::cos(angle - 0.6f);
  Vector3f band = mix(rgb(0x7a3b57), rgb(0x1f4e79), round);
  band *= 1.0f + 0.10f * fractal_noise(p * 0.6f, 4);
  Vector3f const cream = rgb(0xf2e3c2) * (1.0f + 0.05f * fractal_noise(p * 0.9f, 3));
  float const height = p.y() - 6;
  float const text_height = 7.4f;
  float const text_width = words.width() * text_height;
  float pattern = words.ink((along + 0.5f * text_width) / text_height, height / text_height + 0.5f);
  if (std::abs(along) > 0.5f * text_width + 2) {
    constexpr int kDiamonds = 36;
    float const cell = 2 * kPi / kDiamonds;
    float const index = std::round(angle / cell);
    float const x = (angle - index * cell) * kPlinthRadius;
    float const diamond = std::abs(x) / 2.4f + std::abs(height) / 3.2f;
    pattern = inside(diamond - 1, 0.15f) * (1 - inside(diamond - 0.5f, 0.15f));
    // Every third diamond is filled, with a dot count that differs from place to place.
    if (static_cast<int>(index + kDiamonds) % 3 == 0) pattern = std::max(pattern, inside(diamond - 0.55f, 0.15f));
  }
  Vector3f color = mix(band, cream, pattern);
  float const rim = std::max(soft_step(9.6f, p.y(), 0.3f), 1 - soft_step(2.4f, p.y(), 0.3f));
  return mix(color, cream, rim);
}

Vector3f paint_plinth_top(Vector3f const& p) {
  float const r = std::hypot(p.x(), p.z());
  float const tufts = fractal_noise({p.x() * 0.9f, 3, p.z() * 0.9f}, 4);
  float const broad = fractal_noise({p.x() * 0.09f, 8, p.z() * 0.09f}, 2);
  Vector3f color = mix(rgb(0x4f8a35), rgb(0x9cc255), std::clamp(0.5f + 0.5f * tufts + 0.5f * broad, 0.0f, 1.0f));
  // Daisies on a jittered grid.
  constexpr float kCell = 7.0f;
  float const gx = std::floor(p.x() / kCell), gz = std::floor(p.z() / kCell);
  float const dx = p.x() - (gx + 0.5f + 0.28f * value_noise({gx * 3.1f, 1, gz * 5.3f})) * kCell;
  float const dz = p.z() - (gz + 0.5f + 0.28f * value_noise({gx * 4.7f, 2, gz * 2.9f})) * kCell;
  float const d = std::hypot(dx, dz);
  float const petals = 1.55f + 0.35f * std::cos(6 * std::atan2(dz, dx) + gx);
  color = mix(color, rgb(0xfffaf0), inside(d - petals));
  color = mix(color, rgb(0xf5b921), inside(d - 0.65f));
  Vector3f const cream = rgb(0xf2e3c2) * (1.0f + 0.05f * fractal_noise(p * 0.9f, 3));
  float const edge = kPlinthRadius - 2.6f + 0.5f * std::sin(40 * std::atan2(p.x(), p.z()));
  return mix(color, cream, soft_step(edge, r, 0.35f));
}

Vector3f paint_plinth_bottom(Vector3f const& p) {
  static Lettering const words("Pulli 1997");
  float const r = std::hypot(p.x(), p.z());
  Vector3f const clay = rgb(0xc98d5e) * (1.0f + 0.16f * fractal_noise(p * 0.35f, 5));
  float const rings =
      inside(std::abs(r - 30) - 0.8f) + inside(std::abs(r - 34) - 0.35f) + inside(std::abs(r - 16) - 0.5f);
  float const text_height = 6;
  float const text = words.ink((p.x() + 0.5f * words.width() * text_height) / text_height, p.z() / text_height + 0.5f);
  float const spokes = inside(std::abs(std::sin(6 * std::atan2(p.z(), p.x()))) * r - 1.2f) * soft_step(19, r, 0.4f) *
                       (1 - soft_step(28, r, 0.4f));
  return mix(clay, rgb(0x4a2a1a), std::clamp(rings + text + spokes, 0.0f, 1.0f));
}

Vector3f paint_plinth(Vector3f const& p) {
  float const r = std::hypot(p.x(), p.z());
  if (p.y() > kPlinthTop - 0.6f && r < kPlinthRadius - 0.6f) return paint_plinth_top(p);
  if (p.y() < 0.4f && r < kPlinthRadius - 0.6f) return paint_plinth_bottom(p);
  return paint_plinth_side(p);
}

/// Hairs: noise drawn out along the direction in which the fur lies.
float hairs(Vector3f const& p) {
  return 0.65f * value_noise({p.x() * 1.5f, p.y() * 0.42f, p.z() * 1.0f}) +
         0.35f * value_noise({p.x() * 2.9f, p.y() * 0.8f + 40, p.z() * 2.1f});
}

/// Distance to the mouth's line on the front of the snout, in the head's frame.
float mouth_distance(Vector3f const& h) {
  float const x = std::abs(h.x());
  float const line = h.y() > 69.2f && h.y() < 74 ? x : 1e3f;
  float const smile = h.y() < 69.6f ? std::abs(std::hypot(x - 3.3f, h.y() - 69.4f) - 3.3f) : 1e3f;
  return std::min(line, smile);
}

Vector3f paint_eye(Vector3f const& h, Vector3f const& eye) {
  Vector3f const n = (h - eye).normalized();
  float const side = eye.x() > 0 ? 1.0f : -1.0f;
  float const gaze = std::acos(std::clamp(n.dot(Vector3f(0.22f * side + 0.1f, 0.10f, 1).normalized()), -1.0f, 1.0f));
  Vector3f color = rgb(0xfdfaf3);
  color = mix(color, rgb(0x6b3a12), inside(gaze - 0.86f, 0.1f));
  color = mix(color, rgb(0x100c0a), inside(gaze - 0.62f, 0.1f));
  float const glint = std::acos(std::clamp(n.dot(Vector3f(0.42f, 0.42f, 1).normalized()), -1.0f, 1.0f));
  return mix(color, rgb(0xffffff), inside(glint - 0.2f, 0.1f));
}

Vector3f paint_dog(Vector3f const& p) {
  Vector3f const h = head_frame().local(p);
  for (float side : {1.0f, -1.0f}) {
    Vector3f const eye(side * kEye.x(), kEye.y(), kEye.z());
    if ((h - eye).norm() < kEyeRadius + 0.08f && h.z() > eye.z()) return paint_eye(h, eye);
  }
  bool const on_head = p.y() > 60 && p.z() > -12;
  float const edge_noise = 2.2f * fractal_noise(p * 0.22f, 3) + 0.8f * hairs(p);
  Vector3f const cream = rgb(0xfdf1dc), brown = rgb(0x9a5a2c), dark = rgb(0x6a3a1d);
  Vector3f color = cream;
  float coat = 0;  // share of the brown coat
  // The saddle over the back, two patches on the haunches, the tail but for its tip.
  coat = std::max(coat, inside(ellipsoid_distance(p, {2, 40, -20}, {17, 18, 15}) + edge_noise, 0.8f));
  coat = std::max(coat, inside(sphere_distance(p, {22, 24, -2}, 7.5f) + edge_noise, 0.8f));
  coat = std::max(coat, inside(sphere_distance(p, {-20, 30, 4}, 5.5f) + edge_noise, 0.8f));
  bool const on_tail = p.z() < -25 && (p.x() > 4 || p.z() < -30);
  if (on_tail) coat = 1 - soft_step(40 + edge_noise, p.y(), 1.0f);
  if (on_head) {
    coat = 0;
    coat = inside(ear_distance({std::abs(h.x()), h.y(), h.z()}) - 0.9f + 0.3f * edge_noise, 0.8f);
    coat = std::max(coat, inside(ellipsoid_distance(h, {8.5f, 82, 19}, {6.5f, 7.5f, 7}) + 0.5f * edge_noise, 0.6f));
    coat = std::max(coat, inside(ellipsoid_distance(h, {-4, 92, -6}, {12, 9, 11}) + 0.7f * edge_noise, 0.8f));
  }
  color = mix(color, mix(brown, dark, std::clamp(0.5f + 0.9f * fractal_noise(p * 0.13f, 3), 0.0f, 1.0f)), coat);
  // Spots on what stayed cream: a jittered grid of three sizes.
  if (!on_head && !on_tail) {
    float const spots = spots_distance(p, 8.5f, 2);
    float const belly = soft_step(0, p.z() - 6, 4) * soft_step(24, p.y(), 4);  // white breast
    color = mix(color, rgb(0x7b4a28), inside(spots + 0.3f * edge_noise, 0.4f) * (1 - coat) * (1 - belly));
  }
  if (on_head && h.z() > 18) {
    color = mix(color, rgb(0x3a1c14), inside(mouth_distance(h) - 0.42f) * soft_step(26.5f, h.z(), 1));
    // Freckles beside the nose.
    float const fx = std::abs(h.x()) - 4.2f, fy = h.y() - 72;
    float const freckle = std::hypot(fx - 1.7f * std::round(std::clamp(fx / 1.7f, -0.5f, 0.5f)),
                                     fy - 1.7f * std::round(std::clamp(fy / 1.7f, -0.5f, 0.5f)));
    if (std::abs(fx) < 2.2f && std::abs(fy) < 2.2f && h.z() > 24)
      color = mix(color, rgb(0x8a5a3a), inside(freckle - 0.38f));
  }
  // Claws, as lines between the toes.
  if (p.y() < 16.8f && p.z() > 22) {
    float const x = std::abs(p.x());
    color = mix(color, rgb(0x4a2c1a), inside(std::abs(x - 7.9f) - 0.3f) * soft_step(24, p.z(), 0.6f));
  }
  return color * (1.0f + 0.13f * hairs(p) + 0.06f * fractal_noise(p * 0.05f, 2));
}

Vector3f paint_collar(Vector3f const& p) {
  float const angle = std::atan2(p.x(), p.z() - 5.6f);
  float const along = angle * 13.4f;
  float const across = p.y() - 60.2f + 0.28f * (p.z() - 5.6f);
  float const x = along - 3.2f * std::round(along / 3.2f);
  Vector3f const leather = rgb(0xc0272d) * (1.0f + 0.10f * fractal_noise(p * 1.1f, 3));
  Vector3f color = mix(leather, rgb(0xfff3d6), inside(std::hypot(x, across) - 0.75f));
  return mix(color, rgb(0xf0c24b), inside(std::abs(std::abs(across) - 1.55f) - 0.16f));
}

Vector3f paint_tag(Vector3f const& p) {
  float const x = p.x() - kTag.x(), y = p.y() - kTag.y();
  // A paw: a pad and three toes.
  float paw = std::hypot(x / 1.25f, y + 1.3f) - 1.15f;
  for (float toe : {-1.6f, 0.0f, 1.6f})
    paw = std::min(paw, std::hypot(x - toe, y - 0.75f + 0.25f * std::abs(toe)) - 0.55f);
  Vector3f const gold = rgb(0xe3b23c) * (1.0f + 0.12f * fractal_noise(p * 1.3f, 3));
  return mix(gold, rgb(0x6a3f0c), p.z() > kTag.z() - 1 ? inside(paw) : 0.0f);
}

Vector3f paint_hoop(Vector3f const& p) {
  Vector3f const q = hoop_frame().local(p);
  float const around = std::atan2(q.y(), q.x());
  float const about = std::atan2(q.z(), std::hypot(q.x(), q.y()) - kHoopMajor);
  float const wave = std::sin(9 * around + about);
  Vector3f const white = rgb(0xfbf6ea), blue = rgb(0x2a78b5), red = rgb(0xd8442f);
  Vector3f const stripe = std::sin(4.5f * around + 0.5f * about) > 0 ? blue : red;
  Vector3f color = mix(white, stripe, soft_step(0, wave, 0.22f));
  float const speckle = value_noise(p * 1.9f);
  return color * (1.0f - 0.14f * soft_step(0.45f, speckle, 0.2f)) * (1.0f + 0.05f * fractal_noise(p * 0.4f, 3));
}

Vector3f paint_leaf(Vector3f const& p) {
  Frame3 const first = leaf_frame(0), second = leaf_frame(1);
  Vector3f const a = first.local(p), b = second.local(p);
  Vector3f const l = a.squaredNorm() < b.squaredNorm() ? a : b;
  float const vein = std::min(std::abs(l.z()), std::abs(std::remainder(l.x() - 0.9f * std::abs(l.z()), 2.4f)) + 0.25f);
  Vector3f const green = mix(rgb(0x2f6b34), rgb(0x5fa244), 0.5f + 0.5f * fractal_noise(p * 0.5f, 4));
  return mix(green, rgb(0xb9dd86), inside(vein - 0.3f));
}

Vector3f paint_petals(Vector3f const& p) {
  Vector3f const f = flower_frame().local(p);
  float const r = std::hypot(f.x(), f.y());
  float const sector = 2 * kPi / kPetals;
  float const around = std::atan2(f.y(), f.x());
  float const turn = around - sector * std::round(around / sector);
  Vector3f color = mix(rgb(0xffd9e6), rgb(0xe5487f), std::clamp((r - 4) / 8, 0.0f, 1.0f));
  float const streak = std::abs(std::sin(turn * 14));
  color = mix(color, rgb(0xb51f5b), 0.6f * inside(streak - 0.35f, 0.2f) * (1 - soft_step(9.5f, r, 2)));
  return color * (1.0f + 0.07f * fractal_noise(p * 0.9f, 3));
}

Vector3f paint_button(Vector3f const& p) {
  Vector3f const f = flower_frame().local(p);
  // Seeds on two families of spirals.
  float const r = std::hypot(f.x(), f.y()), around = std::atan2(f.y(), f.x());
  float const seeds = std::sin(8 * around + 4 * r) * std::sin(8 * around - 4 * r);
  return mix(rgb(0xf6c22d), rgb(0x8a4a10), soft_step(0.1f, seeds, 0.3f));
}

Vector3f paint_ladybird(Vector3f const& p) {
  Vector3f const l = ladybird_frame().local(p);
  if (l.z() > 1.9f) return rgb(0x18120f);
  float dots = std::abs(l.x()) - 0.22f;
  for (float z : {-1.7f, 0.4f}) dots = std::min(dots, std::hypot(std::abs(l.x()) - 1.2f, l.z() - z) - 0.6f);
  return mix(rgb(0xd92a1c), rgb(0x18120f), inside(dots));
}

}  // namespace

Vector3f paint_statuette(Vector3f const& p, StatuettePart part) {
  switch (part) {
    case StatuettePart::plinth:
      return paint_plinth(p);
    case StatuettePart::dog:
      return paint_dog(p);
    case StatuettePart::nose:
      return rgb(0x241a18) * (1.0f + 0.35f * soft_step(0.3f, value_noise(p * 2.2f), 0.3f));
    case StatuettePart::tongue:
      return rgb(0xe8757a) * (1.0f - 0.25f * inside(std::abs(head_frame().local(p).x()) - 0.3f));
    case StatuettePart::collar:
      return paint_collar(p);
    case StatuettePart::tag:
      return paint_tag(p);
    case StatuettePart::hoop:
      return paint_hoop(p);
    case StatuettePart::stem:
      return mix(rgb(0x3f7d35), rgb(0x8cbf5a), soft_step(0, std::sin(2.2f * p.y()), 0.6f));
    case StatuettePart::leaf:
      return paint_leaf(p);
    case StatuettePart::petals:
      return paint_petals(p);
    case StatuettePart::button:
      return paint_button(p);
    case StatuettePart::ladybird:
      return paint_ladybird(p);
  }
  return Vector3f::Ones();
}

}  // namespace scanview
