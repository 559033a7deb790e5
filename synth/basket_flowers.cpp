#include "synth/basket_flowers.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "synth/basket_weave.h"
#include "synth/distance_field.h"
#include "synth/paint.h"

namespace scanview {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;

/// A ring of equal petals about the axis z of a flower's frame. The petal that is drawn points along x.
struct Whorl {
  BladeShape petal;
  int count;
  float phase = 0;  ///< of the first petal, in petals
};

/// p turned about z into the sector of the petal along x.
Vector3f in_sector(Vector3f const& p, Whorl const& whorl) {
  float const sector = 2 * kPi / static_cast<float>(whorl.count);
  float const around = std::atan2(p.y(), p.x()) - sector * whorl.phase;
  float const turn = around - sector * std::round(around / sector), r = std::hypot(p.x(), p.y());
  return {r * std::cos(turn), r * std::sin(turn), p.z()};
}

float whorl_distance(Vector3f const& p, Whorl const& whorl) { return whorl.petal.distance(in_sector(p, whorl)); }

struct PetalPaint {
  Vector3f base, tip, streak;
  float blotch = 0;  ///< the base's colour reaches so far out, mm; 0: it fades into the tip's over the whole petal
};

/// A flower whose face looks along `facing` from `head`.
struct Flower {
  Vector3f head, facing;
  float radius;  ///< of a sphere about the head that holds all
  std::vector<Whorl> whorls;
  PetalPaint petals;
  Vector3f button_radii;  ///< of the ellipsoid in the middle
  float button_height;    ///< of its centre
  Vector3f button, seeds;
};

Vector3f paint_petals(Vector3f const& f, Flower const& flower) {
  Whorl const* nearest = &flower.whorls.front();
  for (Whorl const& whorl : flower.whorls)
    if (whorl_distance(f, whorl) < whorl_distance(f, *nearest)) nearest = &whorl;
  Vector3f const q = in_sector(f, *nearest);
  Blade const& petal = nearest->petal.blade();
  float const reach = (petal.c - petal.a).norm(), out = (q - petal.a).norm();
  PetalPaint const& paint = flower.petals;
  float const t = paint.blotch > 0 ? soft_step(paint.blotch + 0.6f * std::sin(3 * q.y()), out, 1.2f)
                                   : std::clamp(out / reach, 0.0f, 1.0f);
  Vector3f color = mix(paint.base, paint.tip, t);
  float const vein = std::abs(std::sin(q.y() * 2.2f));
  color =
      mix(color, paint.streak, 0.75f * inside(vein - 0.3f, 0.3f) * (1 - soft_step(0.8f * reach, out, 0.3f * reach)));
  return color * (1.0f + 0.08f * fractal_noise(f * 0.8f, 3));
}

Vector3f paint_button(Vector3f const& f, Flower const& flower) {
  // Seeds on two families of spirals.
  float const r = std::hypot(f.x(), f.y()), around = std::atan2(f.y(), f.x());
  float const seeds = std::sin(9 * around + 3 * r) * std::sin(9 * around - 3 * r);
  return mix(flower.button, flower.seeds, soft_step(0.05f, seeds, 0.3f));
}

Vector3f paint_stem(Vector3f const& p) {
  Vector3f const green = mix(rgb(0x476f32), rgb(0x7fa64d), soft_step(0, std::sin(1.4f * p.y()), 1.2f));
  return green * (1.0f + 0.15f * fractal_noise(p * 0.9f, 3));
}

Vector3f root_of(Vector3f const& head) { return {0.35f * head.x(), 30, 0.35f * head.z()}; }

void add_rod(std::vector<Solid>& solids, Vector3f const& a, Vector3f const& b, Vector3f const& c, float ra, float rc) {
  Vector3f const center = 0.25f * a + 0.5f * b + 0.25f * c;
  float const radius = std::max({(a - center).norm(), (c - center).norm(), (b - center).norm()}) + std::max(ra, rc);
  float const sag = 0.5f * (b - 0.5f * (a + c)).norm();  // no point of the curve is further from the straight line
  auto const distance = [=](Vector3f const& p) {
    float const at_least = rod_distance(p, a, c, ra, rc) - sag;
    return at_least > 3 ? at_least : bent_rod_distance(p, a, b, c, ra, rc);
  };
  solids.push_back({center, radius, distance, paint_stem});
}

void add_flower(std::vector<Solid>& solids, Flower const& flower) {
  Vector3f const axis = flower.facing.normalized();
  Frame3 const frame = Frame3::facing(flower.head, axis);
  solids.push_back({flower.head, flower.radius,
                    [=](Vector3f const& p) {
                      Vector3f const f = frame.local(p);
                      float d = 1e3f;
                      for (Whorl const& whorl : flower.whorls) d = std::min(d, whorl_distance(f, whorl));
                      return d;
                    },
                    [=](Vector3f const& p) { return paint_petals(frame.local(p), flower); }});
  Vector3f const button(0, 0, flower.button_height);
  solids.push_back({flower.head + flower.button_height * axis, flower.button_radii.maxCoeff(),
                    [=](Vector3f const& p) { return ellipsoid_distance(frame.local(p), button, flower.button_radii); },
                    [=](Vector3f const& p) { return paint_button(frame.local(p), flower); }});
  Vector3f const root = root_of(flower.head), neck = flower.head + 0.5f * axis;
  float const bow = 0.45f * (flower.head - root).norm();
  add_rod(solids, root, flower.head - bow * axis, neck, 1.25f, 1.1f);
}

Flower daisy(Vector3f const& head, Vector3f const& facing, float size) {
  Blade const petal{{0.2f * size, 0, 0}, {0.6f * size, 0, 0.10f * size}, {size, 0, -0.05f * size}, 0.17f * size, 0.85f};
  return {head,
          facing,
          size + 1,
          {{BladeShape(petal), 13}},
          {rgb(0xe9ecd2), rgb(0xf4f1ea), rgb(0xc9cdb8)},
          Vector3f(0.30f, 0.30f, 0.2f) * size,
          0.4f,
          rgb(0xf2bd2c),
          rgb(0xb8741a)};
}

Flower gerbera(Vector3f const& head, Vector3f const& facing, float size, PetalPaint const& paint) {
  Blade const outer{
      {0.2f * size, 0, 0}, {0.6f * size, 0, 0.08f * size}, {size, 0, -0.12f * size}, 0.155f * size, 0.85f};
  Blade const inner{{0.2f * size, 0, 0.06f * size},
                    {0.5f * size, 0, 0.24f * size},
                    {0.78f * size, 0, 0.20f * size},
                    0.13f * size,
                    0.7f};
  return {head,
          facing,
          1.05f * size + 1,
          {{BladeShape(outer), 15}, {BladeShape(inner), 13, 0.5f}},
          paint,
          Vector3f(0.34f, 0.34f, 0.2f) * size,
          0.08f * size,
          rgb(0x4d3524),
          rgb(0x9c6a2c)};
}

Flower poppy(Vector3f const& head, Vector3f const& facing, float size) {
  Blade const outer{{0, 0, 0}, {0.8f * size, 0, 0.05f * size}, {size, 0, 0.55f * size}, 0.66f * size, 0.75f, 0.1f, 3};
  Blade const inner{
      {0, 0, 0.04f * size}, {0.6f * size, 0, 0.1f * size}, {0.75f * size, 0, 0.6f * size}, 0.5f * size, 0.75f, 0.1f, 3};
  return {head,
          facing,
          1.4f * size,
          {{BladeShape(outer), 4}, {BladeShape(inner), 4, 0.5f}},
          {rgb(0x3a2c30), rgb(0xc8321f), rgb(0xa32417), 0.32f * size},
          {0.17f * size, 0.17f * size, 0.24f * size},
          0.12f * size,
          rgb(0x3d4a2c),
          rgb(0x8a9a5a)};
}

Flower rose(Vector3f const& head, Vector3f const& facing, float size, PetalPaint const& paint) {
  std::vector<Whorl> whorls;
  // Cups within cups, the outer ones opening outwards.
  for (int i = 0; i < 4; ++i) {
    float const out = size * (0.22f + 0.24f * static_cast<float>(i)),
                top = size * (0.98f - 0.17f * static_cast<float>(i));
    float const lip = i < 2 ? 0.0f : 0.16f * size * static_cast<float>(i - 1);
    Blade const petal{{0.12f * size, 0, -0.35f * size},
                      {1.15f * out, 0, -0.3f * size},
                      {out + lip, 0, top},
                      0.62f * out + 0.12f * size,
                      0.8f,
                      0.25f,
                      4};
    whorls.push_back({BladeShape(petal), i == 0 ? 3 : 5, 0.37f * static_cast<float>(i)});
  }
  return {head, facing, 1.6f * size, whorls, paint, Vector3f(0.36f, 0.36f, 0.45f) * size, 0, paint.base, paint.tip};
}

Flower tulip(Vector3f const& head, Vector3f const& facing, float size, PetalPaint const& paint) {
  Blade const outer{{0, 0, -0.1f * size},
                    {0.75f * size, 0, -0.1f * size},
                    {0.42f * size, 0, 1.25f * size},
                    0.40f * size,
                    0.8f,
                    0.12f,
                    2};
  Blade const inner{
      {0, 0, -0.05f * size}, {0.58f * size, 0, 0}, {0.3f * size, 0, 1.18f * size}, 0.38f * size, 0.8f, 0.12f, 2};
  return {head,         facing,
          1.6f * size,  {{BladeShape(outer), 3}, {BladeShape(inner), 3, 0.5f}},
          paint,        {0.12f * size, 0.12f * size, 0.5f * size},
          0.2f * size,  rgb(0xd9d06a),
          rgb(0x5a5a2c)};
}

Flower forget_me_not(Vector3f const& head, Vector3f const& facing) {
  return {head,
          facing,
          6.5f,
          {{BladeShape({{0.8f, 0, 0}, {3.2f, 0, 0.4f}, {5.4f, 0, 0.2f}, 2.1f, 0.75f, 0, 3}), 5}},
          {rgb(0xf0eef0), rgb(0x4a78c8), rgb(0x3a5fb0), 1.3f},
          {1.4f, 1.4f, 1.1f},
          0.3f,
          rgb(0xf0c23a),
          rgb(0xd08a1c)};
}

/// A spike of small blossoms on a thin stem.
void add_lavender(std::vector<Solid>& solids, Vector3f const& bend, Vector3f const& top) {
  add_rod(solids, root_of(top), bend, top, 1.0f, 0.8f);
  Vector3f const axis = (top - bend).normalized();
  Frame3 const frame = Frame3::facing(top, axis);
  constexpr float kLength = 20, kStep = 2.9f;
  auto const distance = [=](Vector3f const& p) {
    Vector3f const f = frame.local(p);
    float const level = std::clamp(std::round(f.z() / kStep), -std::floor(kLength / kStep), 0.0f);
    float const turn = std::atan2(f.y(), f.x()) + 0.52f * level;
    float const sector = 2 * kPi / 5, r = std::hypot(f.x(), f.y());
    float const around = turn - sector * std::round(turn / sector);
    float const size = 1.0f + 0.03f * level;  // they grow towards the lower end
    Vector3f const q(r * std::cos(around), r * std::sin(around), f.z() - kStep * level);
    float const core = rod_distance(f, {0, 0, -kLength}, {0, 0, 0}, 1.7f, 1.5f);
    return std::min(core, ellipsoid_distance(q, {1.6f / size, 0, 0}, {1.5f, 1.1f, 1.75f}));
  };
  solids.push_back({top - 0.5f * kLength * axis, 0.5f * kLength + 5, distance, [=](Vector3f const& p) {
                      float const shade = 0.5f + 0.5f * fractal_noise(p * 0.7f, 3);
                      Vector3f const color = mix(rgb(0x5a3f8a), rgb(0xa78bd0), shade);
                      return mix(color, rgb(0x5f7a4a), soft_step(0.45f, value_noise(p * 0.9f), 0.2f));
                    }});
}

Vector3f paint_leaf(Vector3f const& p, Blade const& leaf, bool ivy) {
  Vector3f const across = (leaf.b - leaf.a).cross(leaf.c - leaf.a).normalized();
  float const s = (p - leaf.a).dot(across), along = (p - leaf.a).dot((leaf.c - leaf.a).normalized());
  float const vein =
      std::min(std::abs(s), std::abs(std::remainder(along - 0.9f * std::abs(s), ivy ? 2.6f : 3.4f)) + 0.2f);
  Vector3f const dark = ivy ? rgb(0x3a4f33) : rgb(0x3c6b35), light = ivy ? rgb(0x5d7a48) : rgb(0x79a548);
  Vector3f color = mix(dark, light, std::clamp(0.5f + 0.8f * fractal_noise(p * 0.35f, 3), 0.0f, 1.0f));
  color = mix(color, ivy ? rgb(0xd5dcae) : rgb(0xbfd88a), 0.8f * inside(vein - 0.32f));
  if (ivy) color = mix(color, rgb(0xe3e4c4), inside(0.72f * leaf.half_width - std::abs(s), 0.5f));
  return color;
}

void add_leaf(std::vector<Solid>& solids, Blade const& leaf, bool ivy) {
  BladeShape const shape(leaf);
  solids.push_back({shape.center(), shape.radius(), [=](Vector3f const& p) { return shape.distance(p); },
                    [=](Vector3f const& p) { return paint_leaf(p, leaf, ivy); }});
}

void add_ivy(std::vector<Solid>& solids) {
  Vector3f const a(-13, 38, 20), b(-20, 52, 50), c(-27, 14, 37);
  add_rod(solids, a, b, c, 1.0f, 0.8f);
  for (int i = 0; i < 7; ++i) {
    float const t = 0.3f + 0.7f * static_cast<float>(i) / 6, side = i % 2 == 0 ? 1.0f : -1.0f;
    Vector3f const at = (1 - t) * (1 - t) * a + 2 * t * (1 - t) * b + t * t * c;
    Vector3f const out(0.55f * side - 0.2f, -0.55f, 0.35f);
    float const size = 10.5f - 3.5f * t;
    add_leaf(
        solids,
        {at, at + size * (0.5f * out + Vector3f(0, 0.1f, 0.32f)), at + size * out, 0.42f * size, 0.7f, 0.06f, 2.5f},
        true);
  }
}

float moss_top(float r, Vector3f const& p) {
  float const lumps = 1.5f * value_noise(p * 0.24f) + 0.8f * value_noise(p * 0.55f);
  return 42 - 0.014f * r * r + lumps;
}

float moss_distance(Vector3f const& p) {
  if (p.y() > 50) return p.y() - 45;
  float const r = std::hypot(p.x(), p.z());
  float const wall = r - basket_wall_radius(p.y()) + 0.5f;
  return 0.8f * std::max({wall, p.y() - moss_top(r, p), 3 - p.y()});
}

Vector3f paint_moss(Vector3f const& p) {
  float const fine = fractal_noise(p * 0.8f, 3), broad = fractal_noise(p * 0.12f, 2);
  Vector3f const color = mix(rgb(0x35432a), rgb(0x6f8a3e), std::clamp(0.4f + 0.9f * fine + 0.4f * broad, 0.0f, 1.0f));
  return mix(color, rgb(0xa9b565), soft_step(0.5f, value_noise(p * 1.1f), 0.2f));
}

}  // namespace

std::vector<Solid> basket_flowers() {
  std::vector<Solid> solids = {{{0, 22, 0}, 46, moss_distance, paint_moss}};
  PetalPaint const sunny{rgb(0xd8761c), rgb(0xf0b92e), rgb(0xc4611a)},
      orange{rgb(0xc9402a), rgb(0xe98a4a), rgb(0xb8331f)};
  PetalPaint const pink{rgb(0xc22f62), rgb(0xf49fb8), rgb(0xd9557f)},
      yellow{rgb(0xd98a22), rgb(0xf5d564), rgb(0xe0a030)};
  PetalPaint const red{rgb(0xe8c34a), rgb(0xb81f2c), rgb(0xd9662c), 4},
      violet{rgb(0xe6d9e8), rgb(0x6a2a78), rgb(0x9a5aa8), 4};

  add_flower(solids, gerbera({1, 70, 20}, {0.05f, 0.42f, 1}, 15.5f, sunny));
  add_flower(solids, gerbera({-5, 64, -24}, {-0.15f, 0.4f, -1}, 14, orange));
  add_flower(solids, daisy({-20, 60, 22}, {-0.55f, 0.45f, 0.9f}, 11));
  add_flower(solids, daisy({21, 76, -12}, {0.6f, 0.7f, -0.5f}, 10.5f));
  add_flower(solids, daisy({3, 49, 36}, {0.1f, 0.3f, 1}, 8.5f));
  add_flower(solids, daisy({-26, 52, -20}, {-0.8f, 0.5f, -0.7f}, 9));
  add_flower(solids, poppy({-21, 73, -3}, {-0.5f, 0.8f, 0.45f}, 11));
  add_flower(solids, rose({19, 57, 22}, {0.5f, 0.6f, 0.8f}, 9.5f, pink));
  add_flower(solids, rose({14, 55, -24}, {0.4f, 0.6f, -0.9f}, 9, yellow));
  add_flower(solids, tulip({-8, 90, -4}, {-0.2f, 1, 0.05f}, 13, red));
  add_flower(solids, tulip({12, 94, 2}, {0.22f, 1, 0.15f}, 12, violet));
  add_flower(solids, tulip({9, 84, -21}, {0.2f, 1, -0.45f}, 11, red));
  std::vector<Vector3f> const small = {{-11, 49, 33}, {-5.5f, 53, 31}, {13, 47, 34}, {-33, 46, 8},  {-35, 50, -2},
                                       {33, 47, -12}, {30, 50, -19},   {2, 47, -35}, {-9, 48, -36}, {34, 46, 12}};
  for (Vector3f const& head : small) add_flower(solids, forget_me_not(head, {head.x(), 20, head.z()}));
  add_lavender(solids, {-16, 80, 12}, {-23, 106, 12});
  add_lavender(solids, {3, 88, -12}, {2, 116, -14});
  add_lavender(solids, {20, 84, -16}, {27, 104, -22});

  // Long leaves that arch over the rim, and some that stand among the flowers.
  auto const leaf = [&](Vector3f const& a, Vector3f const& b, Vector3f const& c, float half_width) {
    add_leaf(solids, {a, b, c, half_width, 0.75f}, false);
  };
  leaf({-12, 38, 8}, {-34, 66, 22}, {-50, 44, 26}, 4.5f);
  leaf({12, 38, 10}, {30, 62, 34}, {42, 40, 40}, 4.5f);
  leaf({12, 38, -8}, {36, 70, -26}, {50, 52, -24}, 4.8f);
  leaf({-10, 38, -12}, {-28, 66, -40}, {-36, 42, -44}, 4.5f);
  leaf({4, 38, -14}, {14, 62, -42}, {20, 40, -46}, 4.2f);
  leaf({-4, 38, 4}, {-10, 80, 20}, {-18, 90, 30}, 4.2f);
  leaf({6, 38, 2}, {12, 84, 10}, {30, 92, 14}, 4.2f);
  leaf({0, 38, -4}, {-8, 86, -12}, {-20, 96, -22}, 4.2f);
  add_ivy(solids);
  return solids;
}

}  // namespace scanview
