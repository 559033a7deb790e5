#include "synth/dog_paint.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

Vector3f const kCream = rgb(0xf1e4cb), kCaramel = rgb(0xbd8248), kDark = rgb(0x43352c), kThread = rgb(0x3d3330);
Vector3f const kPink = rgb(0xe0938c);

/// Share of thread in a row of stitches: `along` the seam, `across` it.
float stitches(float along, float across, float pitch, float half_length, float half_width) {
  float const x = along - pitch * std::round(along / pitch);
  return inside(std::max(std::abs(x) - half_width, std::abs(across) - half_length), 0.25f);
}

/// Threads over and under, as in canvas: about [0.88, 1.06].
float weave(float u, float v) { return 0.97f + 0.09f * std::sin(4.6f * u) * std::sin(4.6f * v); }

Vector3f paint_square_patch(Vector3f const& p, float distance) {
  float const y = p.y() - 54 + 0.12f * (p.z() + 9), z = p.z() + 9 - 0.12f * (p.y() - 54);
  // Gingham: two families of bands that darken where they cross.
  constexpr float kBand = 2.6f;
  float const a = soft_step(0, std::sin(kPi * y / kBand), 0.25f), b = soft_step(0, std::sin(kPi * z / kBand), 0.25f);
  Vector3f const color = mix(mix(rgb(0xf0e6d8), rgb(0xd98a7c), std::max(a, b)), rgb(0xa8322c), a * b) * weave(y, z);
  bool const upright = std::abs(z) * 8.5f > std::abs(y) * 10;  // the side of the square that is nearest
  return mix(color, kThread, stitches(upright ? y : z, distance + 0.5f, 2.2f, 1.1f, 0.42f));
}

Vector3f paint_heart_patch(Vector3f const& p, float distance) {
  float const y = p.y() - 52, z = p.z() + 10;
  Vector3f color = rgb(0x35608f) * weave(y, z) * (1 + 0.12f * fractal_noise(p * 0.5f, 3));
  float const u = y - 3.4f * std::round(y / 3.4f);
  float const shift = 1.7f * std::fmod(std::abs(std::round(y / 3.4f)), 2.0f);
  float const v = z + shift - 3.4f * std::round((z + shift) / 3.4f);
  color = mix(color, rgb(0xe8e2d0), inside(std::hypot(u, v) - 0.72f));
  float const around = std::atan2(y, z) * 9;
  return mix(color, rgb(0xe9c46a), stitches(around, distance + 1.1f, 1.9f, 0.35f, 0.6f));
}

/// The coat on the head, without what is embroidered on it.
Vector3f coat_of_head(Vector3f const& h, float ragged) {
  Vector3f color = kCaramel;
  color = mix(color, kDark, inside(ellipsoid_distance(h, {10.5f, 99, 44}, {8.5f, 9.5f, 12}) + 0.5f * ragged, 0.7f));
  color = mix(color, kDark, inside(ellipsoid_distance(h, {-8, 112, 12}, {14, 9, 14}) + 0.8f * ragged, 0.8f));
  // The blaze from the crown to the snout, which it covers.
  float const half = 2.2f + 0.22f * std::max(0.0f, 103 - h.y()) + 0.4f * ragged;
  float blaze = h.z() > 26 ? inside(std::abs(h.x() + 0.8f) - half, 0.7f) : 0.0f;
  blaze = std::max(blaze, inside(ellipsoid_distance(h, {0, 86, 54}, {12.5f, 8.5f, 14}) + 0.5f * ragged, 0.7f));
  color = mix(color, kCream, blaze);
  return color;
}

Vector3f coat_of_ears(Vector3f const& h, float ragged) {
  if (h.x() > 0) {
    Vector3f const color = mix(kDark, kCaramel, inside(std::abs(spots_distance(h, 7, 1.3f)) - 0.35f, 0.4f));
    return mix(color, kPink, inside(ellipsoid_distance(h, {21.5f, 91, 22}, {4, 14, 9}), 0.5f));  // the inner side
  }
  Vector3f const color =
      mix(kCream, kDark, inside(spots_distance(h + Vector3f::Constant(3), 6.5f, 1.5f) + 0.3f * ragged));
  return color;
}

Vector3f coat_of_torso(Vector3f const& p, float ragged) {
  Vector3f color = kCream;
  // A saddle that hangs further down on the left, dapples where the coat stays pale.
  float const saddle = ellipsoid_distance(p, {5, 72, -22}, {20, 20, 25}) + ragged;
  color = mix(color, kCaramel, inside(saddle - 2.6f, 0.8f));
  color = mix(color, kDark, inside(saddle, 0.8f));
  float const shoulder = ellipsoid_distance(p, {-17, 59, 9}, {9, 8, 12}) + 1.6f * ragged;
  color = mix(color, kCaramel, inside(shoulder, 0.8f));
  float const breast = soft_step(14, p.z(), 6) * soft_step(42, p.y(), 6);
  float const pale = inside(-std::min(saddle - 2.6f, shoulder), 0.8f) * (1 - breast);
  color = mix(color, kDark, pale * inside(spots_distance(p, 8.5f, 1.7f) + 0.25f * ragged, 0.4f));
  color =
      mix(color, kCaramel, pale * inside(spots_distance(p + Vector3f(40, 3, 11), 7.5f, 1.3f) + 0.25f * ragged, 0.4f));
  // Rings of a darker brown in the dark, so that it is not one tone.
  float const rosette = std::abs(spots_distance(p + Vector3f(9, 50, 4), 9, 2)) - 0.45f;
  return mix(color, rgb(0x8a5f3c), inside(saddle + 2, 0.8f) * inside(rosette, 0.4f));
}

Vector3f coat_of_leg(Vector3f const& p, int leg, float ragged) {
  float const sock = 14.5f + (leg % 2 == 0 ? 2.5f : -1.5f) + 0.7f * ragged;
  Vector3f upper = coat_of_torso(p, ragged);
  if (leg >= 2) {  // brindle
    float const stripe = std::sin(1.25f * p.y() + 0.35f * p.z() + 1.6f * fractal_noise(p * 0.15f, 2));
    upper = mix(upper, mix(kCaramel, kDark, soft_step(0.1f, stripe, 0.35f)), soft_step(38 + ragged, 76 - p.y(), 1));
  }
  Vector3f const lower = leg == 1 ? kDark : kCream;
  Vector3f color = mix(lower, upper, soft_step(sock, p.y(), 0.8f));
  if (leg == 0) color = mix(color, kCaramel, inside(std::abs(p.y() - sock) - 1.0f - 0.2f * ragged, 0.5f));
  return color;
}

/// Pads of the sole, three lines between the toes.
Vector3f paint_paw(Vector3f color, Vector3f const& p, int leg) {
  static Vector3f const paws[] = {{12.5f, 0, 23.5f}, {-12.5f, 0, 17}, {12.5f, 0, -34.5f}, {-12.5f, 0, -28}};
  Vector3f const q = p - paws[leg];
  if (p.y() < 0.3f) {
    float pads = std::hypot(q.x() / 1.25f, q.z() + 1.5f) - 2.9f;
    for (float toe : {-3.9f, 0.0f, 3.9f})
      pads = std::min(pads, std::hypot(q.x() - toe, q.z() - 4.9f + 0.3f * std::abs(toe)) - 1.35f);
    return mix(color, kPink, inside(pads));
  }
  float const between = std::abs(std::abs(q.x()) - 2.1f);
  Vector3f const line = leg == 1 ? kCream : kThread;
  return mix(color, line,
             inside(between - 0.42f) * soft_step(5.6f, q.z(), 0.5f) * soft_step(1.5f, p.y(), 0.5f) *
                 (1 - soft_step(10.5f, p.y(), 0.5f)));
}

Vector3f embroider_face(Vector3f color, Vector3f const& h) {
  if (h.z() < 30) return color;
  for (float side : {1.0f, -1.0f}) {
    Vector3f const eye(side * kDogEye.x(), kDogEye.y(), kDogEye.z());
    float const from_eye = (h - eye).norm();
    color = mix(color, kCream, inside(from_eye - 5.3f) * (h.z() > 40 ? 1.0f : 0.0f));  // a felt disc under the bead
    color = mix(color, kThread, inside(std::abs(from_eye - 5.4f) - 0.3f) * (h.z() > 40 ? 1.0f : 0.0f));
    Vector3f const brow = h - Vector3f(side * 8.6f, 106.6f, 46);
    color = mix(color, side > 0 ? kCaramel : kDark, inside(std::hypot(brow.x(), 1.6f * brow.y()) - 2.3f, 0.4f));
    // Freckles where whiskers would grow.
    for (auto const& [x, y] : {std::pair{5.2f, 87.6f}, {7.4f, 88.2f}, {6.2f, 85.4f}, {8.3f, 85.8f}})
      if (h.z() > 48) color = mix(color, rgb(0x6b4a34), inside(std::hypot(h.x() - side * x, h.y() - y) - 0.55f));
  }
  return mix(color, kThread, inside(dog_mouth_distance(h) - 0.5f));
}

Vector3f paint_fur(Vector3f const& p) {
  float const square = dog_square_patch_distance(p), heart = dog_heart_patch_distance(p);
  if (square < 0.25f) return paint_square_patch(p, square);
  if (heart < 0.25f) return paint_heart_patch(p, heart);

  Vector3f const h = dog_head_frame().local(p);
  float const hairs = dog_hairs(p);
  float const ragged = 2.0f * fractal_noise(p * 0.2f, 3) + 0.9f * hairs;
  Vector3f color;
  float const skull = dog_skull_distance(h), torso = dog_torso_distance(p), tail = dog_tail_distance(p);
  float const ear = std::min(dog_left_ear().distance(h), dog_right_ear().distance(h));
  int leg = 0;
  for (int i = 1; i < 4; ++i)
    if (dog_leg_distance(p, i) < dog_leg_distance(p, leg)) leg = i;
  float const lowest = std::min({skull, torso, tail, ear, dog_leg_distance(p, leg)});
  if (lowest == ear)
    color = coat_of_ears(h, ragged);
  else if (lowest == skull)
    color = embroider_face(coat_of_head(h, ragged), h);
  else if (lowest == tail) {
    float const stripe = std::sin(0.75f * (p.y() - 0.8f * p.z()));
    color = mix(kCaramel, kDark, soft_step(0.1f * ragged, stripe, 0.3f));
    color = mix(color, kCream, soft_step(84 + ragged, p.y(), 0.8f));
  } else if (lowest == torso)
    color = coat_of_torso(p, ragged);
  else
    color = paint_paw(coat_of_leg(p, leg, ragged), p, leg);
  color *= 1.0f + 0.17f * hairs + 0.08f * fractal_noise(p * 0.07f, 2);

  // The seam is sewn with a thread that shows.
  float const seam = dog_seam_distance(p);
  if (seam < 3 && ((lowest == torso && p.z() < 6) || (lowest == skull && h.z() < 22))) {
    float const along = lowest == skull ? 17 * std::atan2(h.z() - 30, h.y() - 90) : p.z();
    Vector3f const thread = lowest == skull || p.y() < 45 ? kThread : rgb(0xd9a441);
    color = mix(color, thread, stitches(along, seam, 2.3f, 1.3f, 0.4f));
  }
  return color;
}

Vector3f paint_eye(Vector3f const& p) {
  Vector3f const h = dog_head_frame().local(p);
  Vector3f const eye((h.x() > 0 ? 1.0f : -1.0f) * kDogEye.x(), kDogEye.y(), kDogEye.z());
  Vector3f const n = (h - eye).normalized();
  auto const off = [&](Vector3f const& axis) { return std::acos(std::clamp(n.dot(axis.normalized()), -1.0f, 1.0f)); };
  float const gaze = off({0.25f * (h.x() > 0 ? 1.0f : -1.0f), 0.05f, 1});
  Vector3f color = mix(rgb(0x3a302a), rgb(0x8a5526), inside(gaze - 0.85f, 0.1f));
  color = mix(color, rgb(0x332b28), inside(gaze - 0.55f, 0.1f));
  return mix(color, rgb(0xf4f2ee),
             inside(std::min(off({0.45f, 0.45f, 1}) - 0.24f, off({-0.15f, -0.3f, 1}) - 0.1f), 0.08f));
}

Vector3f paint_collar(Vector3f const& p) {
  Vector3f const c = dog_collar_frame().local(p);
  float const along = std::atan2(c.x(), -c.y()) * kDogCollarRadius;
  Vector3f color = rgb(0x1f7a78) * (1 + 0.10f * fractal_noise(p * 1.1f, 3));
  // Slanting stripes of three colours between two hems.
  float const slant = std::remainder(along + 0.9f * c.z(), 6.0f);
  color = mix(color, rgb(0xf0e3c0), inside(std::abs(slant) - 1.1f));
  color = mix(color, rgb(0xd0702c), inside(std::abs(slant - 1.9f) - 0.45f));
  return mix(color, rgb(0xe0b84f), inside(std::abs(std::abs(c.z()) - 2.3f) - 0.22f));
}

Vector3f paint_tag(Vector3f const& p) {
  static Lettering const words("1997");
  Vector3f const t = dog_tag_frame().local(p);
  Vector3f const brass = rgb(0xd9b04a) * (1.0f + 0.10f * fractal_noise(p * 1.3f, 3));
  constexpr float kHeight = 5.4f;
  float const side = t.z() > 0 ? 1.0f : -1.0f;
  float const ink =
      words.ink((side * t.x() + 0.5f * words.width() * kHeight) / kHeight, (t.y() + 0.5f) / kHeight + 0.5f);
  return mix(brass, rgb(0x5a3a18), ink);
}

Vector3f paint(Vector3f const& p, DogPart part) {
  switch (part) {
    case DogPart::fur:
      return paint_fur(p);
    case DogPart::nose:
      return rgb(0x3c3230) * (1.0f + 0.30f * soft_step(0.3f, value_noise(p * 2.0f), 0.3f));
    case DogPart::eye:
      return paint_eye(p);
    case DogPart::tongue:
      return rgb(0xd9666c) * (1.0f - 0.25f * inside(std::abs(dog_head_frame().local(p).x()) - 0.35f));
    case DogPart::collar:
      return paint_collar(p);
    case DogPart::buckle:
    case DogPart::ring:
      return rgb(0xc9ccd0) * (1.0f + 0.10f * fractal_noise(p * 1.5f, 3));
    case DogPart::tag:
      return paint_tag(p);
  }
  return kCream;
}

}  // namespace

Vector3f paint_dog(Vector3f const& p, DogPart part) { return within_albedo(paint(p, part)); }

}  // namespace scanview
