#include "synth/distance_field.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace scanview {
namespace {

using Eigen::Vector3f;

/// In [-1, 1], of a lattice point.
float lattice_value(int x, int y, int z) {
  auto h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^ static_cast<std::uint32_t>(y) * 0xd8163841u ^
           static_cast<std::uint32_t>(z) * 0xcb1ab31fu;
  h = (h ^ (h >> 16)) * 0x7feb352du;
  h = (h ^ (h >> 15)) * 0x846ca68bu;
  h ^= h >> 16;
  return static_cast<float>(h >> 8) * 0x1p-23f - 1.0f;
}

float mix(float a, float b, float t) { return a + (b - a) * t; }

}  // namespace

float sphere_distance(Vector3f const& p, Vector3f const& center, float radius) { return (p - center).norm() - radius; }

float ellipsoid_distance(Vector3f const& p, Vector3f const& center, Vector3f const& radii) {
  Vector3f const q = (p - center).cwiseQuotient(radii);
  float const k = q.norm();
  float const gradient = q.cwiseQuotient(radii).norm();
  return gradient > 1e-6f ? k * (k - 1) / gradient : -radii.minCoeff();
}

float rod_distance(Vector3f const& p, Vector3f const& a, Vector3f const& b, float ra, float rb) {
  Vector3f const along = b - a;
  float const t = std::clamp((p - a).dot(along) / along.squaredNorm(), 0.0f, 1.0f);
  return (p - a - t * along).norm() - mix(ra, rb, t);
}

float bent_rod_distance(Vector3f const& p, Vector3f const& a, Vector3f const& b, Vector3f const& c, float ra,
                        float rc) {
  constexpr int kPieces = 12;
  float distance = 1e9f;
  Vector3f from = a;
  for (int i = 1; i <= kPieces; ++i) {
    float const t = static_cast<float>(i) / kPieces;
    Vector3f const to = (1 - t) * (1 - t) * a + 2 * t * (1 - t) * b + t * t * c;
    float const r0 = mix(ra, rc, static_cast<float>(i - 1) / kPieces);
    distance = std::min(distance, rod_distance(p, from, to, r0, mix(ra, rc, t)));
    from = to;
  }
  return distance;
}

float box_distance(Vector3f const& p, Vector3f const& half, float rounding) {
  Vector3f const q = p.cwiseAbs() - half + Vector3f::Constant(rounding);
  return q.cwiseMax(0).norm() + std::min(q.maxCoeff(), 0.0f) - rounding;
}

BladeShape::BladeShape(Blade const& blade)
    : blade_(blade),
      across_((blade.b - blade.a).cross(blade.c - blade.a).normalized()),
      center_(0.25f * blade.a + 0.5f * blade.b + 0.25f * blade.c),
      radius_(0) {
  Vector3f from = blade.a;
  radius_ = (from - center_).norm();
  for (int i = 0; i < kPieces; ++i) {
    float const t = static_cast<float>(i + 1) / kPieces;
    Vector3f const to = (1 - t) * (1 - t) * blade.a + 2 * t * (1 - t) * blade.b + t * t * blade.c;
    Vector3f const along = to - from;
    pieces_[i] = {from, along, 1 / along.squaredNorm(), 2 * (1 - blade.start) / (along.norm() * kPieces)};
    radius_ = std::max(radius_, (to - center_).norm());
    from = to;
  }
  radius_ = std::hypot(radius_, blade.half_width) + blade.half_thickness;
}

float BladeShape::distance(Vector3f const& p) const {
  float const outside = (p - center_).norm() - radius_;
  if (outside > 0.25f * radius_) return outside;
  float const s = std::abs((p - blade_.a).dot(across_));
  float nearest = 1e9f, at = 0, u_per_length = 1;
  for (int i = 0; i < kPieces; ++i) {
    Piece const& piece = pieces_[i];
    Vector3f const q = p - piece.from;
    float const free_share = q.dot(piece.along) * piece.inverse_squared;
    float const share = std::clamp(free_share, 0.0f, 1.0f);
    float const squared = (q - share * piece.along).squaredNorm();
    if (squared >= nearest) continue;
    nearest = squared;
    u_per_length = piece.u_per_length;
    at = static_cast<float>(i) + share;
    if (i + 1 == kPieces && free_share > 1) {  // beyond the tip u runs on
      at = static_cast<float>(i) + free_share;
      nearest = (q - free_share * piece.along).squaredNorm();
    }
  }
  // Where the spine is nearest: s across its plane, n within it. First the distance to the outline as if all were flat.
  float const n_squared = std::max(nearest - s * s, 0.0f);
  float const u = std::abs(2 * (blade_.start + (1 - blade_.start) * at / kPieces) - 1), v = s / blade_.half_width;
  float const power = std::pow(u, blade_.fullness - 1), level = power * u + v * v;
  float const gradient = std::hypot(0.5f * blade_.fullness * power * u_per_length, v / blade_.half_width);
  float const outline = gradient > 1e-6f ? (level - std::sqrt(level)) / gradient : -blade_.half_width;
  float const beyond = std::max(outline + blade_.half_thickness, 0.0f);
  return std::sqrt(beyond * beyond + n_squared) - blade_.half_thickness;
}

float ring_distance(Vector3f const& p, float major, float minor) {
  return std::hypot(std::hypot(p.x(), p.y()) - major, p.z()) - minor;
}

float disc_distance(Vector3f const& p, float radius, float low, float high, float rounding) {
  float const x = std::hypot(p.x(), p.z()) - radius + rounding;
  float const y = std::abs(p.y() - 0.5f * (low + high)) - 0.5f * (high - low) + rounding;
  return std::min(std::max(x, y), 0.0f) + std::hypot(std::max(x, 0.0f), std::max(y, 0.0f)) - rounding;
}

float smooth_union(float a, float b, float k) {
  float const h = std::max(k - std::abs(a - b), 0.0f) / k;
  return std::min(a, b) - 0.25f * h * h * k;
}

Frame3::Frame3(Vector3f const& pivot, Vector3f const& axis, float angle_rad)
    : to_local_(Eigen::AngleAxisf(-angle_rad, axis.normalized()).toRotationMatrix()), origin_(pivot), pivot_(pivot) {}

Frame3 Frame3::facing(Vector3f const& origin, Vector3f const& z) {
  Frame3 frame;
  frame.to_local_ = Eigen::Quaternionf::FromTwoVectors(z.normalized(), Vector3f::UnitZ()).toRotationMatrix();
  frame.origin_ = origin;
  frame.pivot_ = Vector3f::Zero();
  return frame;
}

float value_noise(Vector3f const& p) {
  Vector3f const base = p.array().floor();
  int const x = static_cast<int>(base.x()), y = static_cast<int>(base.y()), z = static_cast<int>(base.z());
  Vector3f const f = p - base;
  Vector3f const s = f.array().square() * (3.0f - 2.0f * f.array());
  auto const row = [&](int j, int k) { return mix(lattice_value(x, j, k), lattice_value(x + 1, j, k), s.x()); };
  return mix(mix(row(y, z), row(y + 1, z), s.y()), mix(row(y, z + 1), row(y + 1, z + 1), s.y()), s.z());
}

float fractal_noise(Vector3f const& p, int octaves) {
  float sum = 0, weight = 0.5f, scale = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += weight * value_noise(scale * p + Vector3f::Constant(17.3f * static_cast<float>(i)));
    weight *= 0.5f;
    scale *= 2.03f;
  }
  return sum;
}

}  // namespace scanview
