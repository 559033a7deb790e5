#include "synth/basket_weave.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "synth/distance_field.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

constexpr float kPitchAngle = 2 * kPi / kBasketStakes;
constexpr float kFoot = 4, kFootRadius = 24.5f;      // top of the foot
constexpr int kRows = 6;                             // of weavers
constexpr float kFirstRow = 6.6f, kRowPitch = 3.4f;  // heights
constexpr float kWeaver = 1.62f, kWave = 1.75f;      // radius of a weaver, how far it winds in and out
constexpr float kStake = 1.3f;                       // radius
constexpr float kHandleRadius = 35.4f;               // of the half circle that ends the two upright legs
constexpr float kHandleBend = kBasketHandleTop - kHandleRadius;
constexpr float kHandleLow = 26;
constexpr int kHandleStrands = 3, kRimStrands = 3;
constexpr float kHandleTwist = 2 * kPi / 17;  // radians a mm
constexpr float kRimTurns = 14;               // on the way around

/// About the y axis: x is the angle from +z towards +x, y the height, z the radius.
Vector3f cylindrical(Vector3f const& p) { return {std::atan2(p.x(), p.z()), p.y(), std::hypot(p.x(), p.z())}; }

/// `count` strands of radius `strand` twisted around a line: (u, v) across it, `along` it in radians of twist. The
/// twist's slope is taken out of the distance.
float rope_distance(float u, float v, float along, int count, float offset, float strand, float slope) {
  float const outside = std::hypot(u, v) - offset - strand;
  if (outside > strand) return outside;
  float const step = 2 * kPi / static_cast<float>(count);
  float const turn = std::atan2(v, u) - along;
  float const phase = along + step * std::round(turn / step);
  float const d = std::hypot(u - offset * std::cos(phase), v - offset * std::sin(phase)) - strand;
  return d / std::sqrt(1 + slope * slope);
}

/// Which of a rope's strands is nearest in the direction `turn`, which is measured in its twisted frame.
int nearest_strand(float turn, int count) {
  auto const strand = static_cast<int>(std::lround(turn * static_cast<float>(count) / (2 * kPi)));
  return (strand % count + count) % count;
}

struct WeaverAt {
  float distance = 1e3f;
  int row = 0;
};

WeaverAt nearest_weaver(Vector3f const& p) {
  Vector3f const c = cylindrical(p);
  WeaverAt nearest;
  int const middle = static_cast<int>(std::floor((c.y() - kFirstRow) / kRowPitch));
  for (int row = middle; row <= middle + 1; ++row) {
    int const j = std::clamp(row, 0, kRows - 1);
    float const y = kFirstRow + kRowPitch * static_cast<float>(j), radius = basket_wall_radius(y);
    // Outside at every other stake, the rows in turn.
    float const angle = 0.5f * kBasketStakes * c.x() + kPi * static_cast<float>(j);
    float const slope = 0.5f * kBasketStakes * kWave * std::sin(angle) / radius;
    float const across = (c.z() - radius - kWave * std::cos(angle)) / std::sqrt(1 + slope * slope);
    // Drawn out inwards, into the moss that fills the bowl: no pockets are left behind the weavers.
    float const d = std::hypot(std::max(across, 0.0f), c.y() - y) - kWeaver;
    if (d < nearest.distance) nearest = {d, j};
  }
  return nearest;
}

float weavers_distance(Vector3f const& p) {
  constexpr float kTop = kFirstRow + kRowPitch * (kRows - 1) + kWeaver;
  if (p.y() > kTop + 4) return p.y() - kTop;
  float const wall = 0.9f * std::abs(std::hypot(p.x(), p.z()) - basket_wall_radius(p.y())) - kWave - kWeaver;
  return wall > 4 ? wall : nearest_weaver(p).distance;
}

float stakes_distance(Vector3f const& p) {
  if (p.y() > kBasketRim + 5) return p.y() - kBasketRim;
  float const wall = 0.9f * std::abs(std::hypot(p.x(), p.z()) - basket_wall_radius(p.y())) - 0.7f - kStake;
  if (wall > 4) return wall;
  Vector3f const c = cylindrical(p);
  float const turn = std::remainder(c.x(), kPitchAngle);
  float const upright = std::hypot(0.93f * (c.z() - basket_wall_radius(c.y())), c.z() * turn) - kStake;
  float d = std::max(upright, std::max(c.y() - kBasketBand - 1.5f, 3 - c.y()));
  if (c.y() < kBasketBand - 4) return d;
  constexpr float kRod = 1.1f, kLean = 0.8f;  // cosine of the lean of the crossed rods
  for (float side : {1.0f, -1.0f}) {
    float const shift = side * kPitchAngle * (c.y() - kBasketBand) / (kBasketRim - kBasketBand);
    float const rod = std::hypot(c.z() - basket_wall_radius(c.y()) - 0.7f * side,
                                 kLean * c.z() * std::remainder(c.x() - shift, kPitchAngle)) -
                      kRod;
    d = std::min(d, std::max(rod, std::max(kBasketBand - c.y(), c.y() - kBasketRim)));
  }
  return d;
}

float rim_distance(Vector3f const& p) {
  Vector3f const c = cylindrical(p);
  return rope_distance(c.z() - basket_wall_radius(kBasketRim), c.y() - kBasketRim, kRimTurns * c.x(), kRimStrands, 1.7f,
                       1.75f, 0.65f);
}

float foot_distance(Vector3f const& p) {
  Vector3f const c = cylindrical(p);
  float const ring = rope_distance(c.z() - kFootRadius, c.y() - 2.5f, 12 * c.x(), 2, 1.2f, 1.5f, 0.55f);
  return std::max(std::min(ring, disc_distance(p, kFootRadius, 1.4f, 4.6f, 0.5f)), -p.y());
}

/// Along the handle from the foot of its leg at x > 0 (x), across it in its plane, outwards (y), and out of it (z).
Vector3f handle_coordinates(Vector3f const& p) {
  float const bend = kHandleRadius * kPi;
  if (p.y() < kHandleBend)
    return p.x() > 0 ? Vector3f(p.y() - kHandleBend, p.x() - kHandleRadius, p.z())
                     : Vector3f(bend + kHandleBend - p.y(), -p.x() - kHandleRadius, p.z());
  float const angle = std::atan2(p.y() - kHandleBend, p.x());
  return {kHandleRadius * angle, std::hypot(p.x(), p.y() - kHandleBend) - kHandleRadius, p.z()};
}

float handle_distance(Vector3f const& p) {
  if (std::abs(p.z()) > 8) return std::abs(p.z()) - 4;
  Vector3f const c = handle_coordinates(p);
  return std::max(rope_distance(c.y(), c.z(), kHandleTwist * c.x(), kHandleStrands, 1.75f, 1.85f, 0.65f),
                  kHandleLow - p.y());
}

/// Willow bark: streaks along the rod, a knot here and there. `along` in mm, `around` in radians.
Vector3f bark(Vector3f const& base, Vector3f const& p, float along, float around, float seed) {
  float const streak = fractal_noise({0.16f * along, 2.2f * std::cos(around) + seed, 2.2f * std::sin(around)}, 3);
  Vector3f color = base * (1.0f + 0.30f * streak + 0.10f * value_noise(p * 1.5f));
  float const knot = value_noise({0.3f * along, 1.3f * std::cos(around) + seed * 3.7f, 1.3f * std::sin(around)});
  return mix(color, 0.6f * base, soft_step(0.78f, knot, 0.12f));
}

Vector3f paint_weavers(Vector3f const& p) {
  static std::array<Vector3f, kRows> const colors = {rgb(0xb98a52), rgb(0xd9b47c), rgb(0x6b4d3a),
                                                     rgb(0x785740), rgb(0xdab981), rgb(0xc39559)};
  int const row = nearest_weaver(p).row;
  Vector3f const c = cylindrical(p);
  float const y = kFirstRow + kRowPitch * static_cast<float>(row), radius = basket_wall_radius(y);
  float const around = std::atan2(c.y() - y, c.z() - radius);
  return bark(colors[row], p, c.x() * radius, around, 7.0f * static_cast<float>(row));
}

Vector3f paint_stakes(Vector3f const& p) {
  Vector3f const c = cylindrical(p);
  return bark(rgb(0xa8753f), p, c.y(), c.x() * kBasketStakes, 50);
}

Vector3f paint_rim(Vector3f const& p) {
  Vector3f const c = cylindrical(p);
  float const v = c.y() - kBasketRim, u = c.z() - basket_wall_radius(kBasketRim);
  int const strand = nearest_strand(std::atan2(v, u) - kRimTurns * c.x(), kRimStrands);
  static std::array<Vector3f, kRimStrands> const colors = {rgb(0xd8b074), rgb(0xb98449), rgb(0x785740)};
  return bark(colors[strand], p, c.x() * 36, std::atan2(v, u), static_cast<float>(strand));
}

Vector3f paint_foot(Vector3f const& p) {
  Vector3f const c = cylindrical(p);
  float const spiral = std::remainder(c.z() + 1.5f * c.x() / kPi, 3.0f);
  bool const over = std::fmod(std::floor(c.x() / kPitchAngle) + std::floor(c.z() / 3) + 100, 2.0f) < 1;
  Vector3f const rod = c.z() > kFootRadius - 1.5f ? rgb(0x9a6a3a) : over ? rgb(0xcfa468) : rgb(0xa87a45);
  return bark(mix(rgb(0x5a3a24), rod, inside(std::abs(spiral) - 1.2f)), p, p.x() + 0.7f * p.z(), c.z(), 9);
}

Vector3f paint_handle(Vector3f const& p) {
  Vector3f const c = handle_coordinates(p);
  // Each of the three strands has its own tone.
  float const around = std::atan2(c.z(), c.y());
  static std::array<Vector3f, kHandleStrands> const colors = {rgb(0xcb9c64), rgb(0xb5834c), rgb(0xd8b27a)};
  int const strand = nearest_strand(around - kHandleTwist * c.x(), kHandleStrands);
  return bark(colors[strand], p, c.x(), around, 21 + 5 * static_cast<float>(strand));
}

/// A bow tied around the handle's leg at x > 0: two loops, two ends and a knot, in the leg's own coordinates (x
/// outwards, z towards the front).
Vector3f const kKnot{kHandleRadius + 0.5f, 64, 3.6f};

std::vector<BladeShape> bow_blades() {
  auto const blade = [](Vector3f const& b, Vector3f const& c, float half_width, float fullness) {
    return BladeShape({kKnot, kKnot + b, kKnot + c, half_width, 0.75f, 0.3f, fullness});
  };
  return {blade({9, 11, 3}, {15, 2, 6}, 3.8f, 6),   blade({8, -6, 6}, {15, 2.5f, 6.5f}, 3.8f, 6),
          blade({-8, 11, 4}, {-13, 2, 7}, 3.8f, 6), blade({-7, -6, 7}, {-13, 2.5f, 7.5f}, 3.8f, 6),
          blade({5, -8, 5}, {9, -24, 3}, 3.4f, 6),  blade({-3, -9, 5}, {-5, -21, 5}, 3.4f, 6)};
}

float bow_distance(Vector3f const& p) {
  static std::vector<BladeShape> const blades = bow_blades();
  float d = ellipsoid_distance(p, kKnot, {3.4f, 3.2f, 3});
  Vector3f const c = handle_coordinates(p);
  d = std::min(d, std::max(std::abs(std::hypot(c.y(), c.z()) - 3.9f) - 0.7f, std::abs(p.y() - kKnot.y()) - 2.4f));
  for (BladeShape const& blade : blades) d = std::min(d, blade.distance(p));
  return d;
}

Vector3f paint_bow(Vector3f const& p) {
  Vector3f const q = p - kKnot;
  float const ring = std::remainder(q.norm(), 4.4f);
  Vector3f const color = mix(rgb(0xb3262e), rgb(0xf3e9dc), inside(std::abs(ring) - 0.55f));
  return color * (1.0f + 0.06f * fractal_noise(p * 0.9f, 3));
}

}  // namespace

float basket_wall_radius(float y) {
  float const t = (y - kFoot) / (kBasketRim - kFoot);
  return 26 + 10 * t * (1.5f - 0.5f * t);
}

std::vector<Solid> basket_weave() {
  return {
      {{0, 15, 0}, 37, weavers_distance, paint_weavers}, {{0, 22, 0}, 45, stakes_distance, paint_stakes},
      {{0, 2, 0}, 28, foot_distance, paint_foot},        {{0, kBasketRim, 0}, 40, rim_distance, paint_rim},
      {{0, 77, 0}, 66, handle_distance, paint_handle},   {kKnot, 27, bow_distance, paint_bow},
  };
}

}  // namespace scanview
