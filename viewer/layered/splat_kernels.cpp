#include "viewer/layered/splat_kernels.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/layered/splat_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace scanview {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;

/// What is known of a vector of splats.
struct alignas(64) Splats {
  float u[16], v[16], key[16], key_u[16], key_v[16], reach_u[16], reach_v[16], weight[16], red[16], green[16], blue[16],
      tolerance[16];
};

/// Whatever is behind so much is not seen.
constexpr float kOpaque = 0.99F;

HWY_INLINE void Put(OutputLayer& layer, float weight, float key, float tolerance, float const (&color)[4]) {
  float* const sums = layer.sums;
  for (int c = 0; c < 4; ++c) sums[c] = color[c] * weight;
  layer.key = key;
  layer.tolerance = tolerance;
  layer.heaviest = weight;
}

HWY_INLINE void AddSample(OutputArea const& area, std::size_t at, float weight, float key, float tolerance, bool fills,
                          float const (&color)[4]) {
  int const count = area.counts[at];
  for (int k = 0; k < count; ++k) {
    OutputLayer& layer = area.layers[k][at];
    float const nearer = key - layer.key;
    if (std::abs(nearer) <= std::max(tolerance, layer.tolerance)) {
      float* const sums = layer.sums;
      if (fills) weight = std::min(weight, std::max(0.0F, 1 - sums[3]));
      for (int c = 0; c < 4; ++c) sums[c] += color[c] * weight;
      if (weight > layer.heaviest) {
        layer.heaviest = weight;
        layer.key = key;
        layer.tolerance = tolerance;
      }
      return;
    }
    if (fills && layer.sums[3] >= 0.7F) return;
    if (nearer > 0) {
      int const last = std::min(count, kOutputLayers - 1);
      for (int j = last; j > k; --j) area.layers[j][at] = area.layers[j - 1][at];
      Put(layer, weight, key, tolerance, color);
      area.counts[at] = static_cast<std::uint8_t>(last + 1);
      return;
    }
    if (layer.sums[3] >= kOpaque) return;
  }
  if (count == kOutputLayers) return;
  Put(area.layers[count][at], weight, key, tolerance, color);
  area.counts[at] = static_cast<std::uint8_t>(count + 1);
}

HWY_INLINE void DrawSplat(Splats const& s, std::size_t i, OutputArea const& area, bool fills) {
  float const u = s.u[i], v = s.v[i], reach_u = s.reach_u[i], reach_v = s.reach_v[i];
  int const left = std::max(area.left, static_cast<int>(std::ceil(u - reach_u))),
            right = std::min(area.right - 1, static_cast<int>(std::floor(u + reach_u)));
  int const top = std::max(area.top, static_cast<int>(std::ceil(v - reach_v))),
            bottom = std::min(area.bottom - 1, static_cast<int>(std::floor(v + reach_v)));
  if (left > right || top > bottom) return;
  float const color[4] = {s.red[i], s.green[i], s.blue[i], 1};
  float const per_u = 1 / reach_u, per_v = 1 / reach_v, weight = s.weight[i];
  for (int y = top; y <= bottom; ++y) {
    float const dy = float(y) - v;
    float const row_weight = weight * (1 - std::abs(dy) * per_v), row_key = s.key[i] + dy * s.key_v[i];
    std::size_t const row = static_cast<std::size_t>(y - area.top) * static_cast<std::size_t>(area.stride);
    for (int x = left; x <= right; ++x) {
      float const dx = float(x) - u;
      float const w = row_weight * (1 - std::abs(dx) * per_u);
      std::size_t const at = row + static_cast<std::size_t>(x - area.left);
      if (!(w > 0) || (area.stencil != nullptr && area.stencil[at] == 0)) continue;
      AddSample(area, at, w, row_key + dx * s.key_u[i], s.tolerance[i], fills, color);
    }
  }
}

std::size_t DrawSplats(LdiPixels const& pixels, std::size_t first, std::size_t count, SplatTransform const& t,
                       OutputArea const& area) {
  Floats const d;
  hn::Rebind<std::int32_t, Floats> const di;
  hn::Rebind<std::uint32_t, Floats> const du;
  hn::Rebind<std::uint8_t, Floats> const du8;
  hn::Rebind<std::int8_t, Floats> const di8;
  hn::Rebind<std::uint16_t, Floats> const du16;
  std::size_t const lanes = hn::Lanes(d);
  auto const one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F), zero = hn::Zero(d);
  auto const m = [&](int row, int column) HWY_ATTR { return hn::Set(d, t.rows[row][column]); };
  std::size_t drawn = 0;
  Splats s;
  for (std::size_t k = 0; k < count; k += lanes) {
    std::size_t const i = first + k;
    auto const x = hn::Add(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(du8, pixels.x + i))), half);
    auto const y = hn::Add(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(du8, pixels.y + i))), half);
    auto const z =
        hn::Mul(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(du16, pixels.depth + i))), hn::Set(d, t.depth_scale));
    auto const scale = hn::Set(d, 1.0F / float(kLdiSlope));
    auto const slope_x = hn::Mul(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(di8, pixels.slope_x + i))), scale);
    auto const slope_y = hn::Mul(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(di8, pixels.slope_y + i))), scale);
    auto const place = [&](int row) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(m(row, 0), x), hn::Mul(m(row, 1), y)), hn::Add(hn::Mul(m(row, 2), z), m(row, 3)));
    };
    auto const pu = place(0), pv = place(1), depth = place(2);
    auto valid = hn::FirstN(d, count - k);
    auto per_z = one;
    if (t.perspective != 0) {
      valid = hn::And(valid, hn::Gt(depth, hn::Set(d, t.near)));
      per_z = hn::Div(one, hn::Max(depth, hn::Set(d, t.near)));
    }
    auto const u = hn::Mul(pu, per_z), v = hn::Mul(pv, per_z);
    // How the screen moves with a grid step along x and along y on the tangent plane.
    auto const step = [&](int row, int column, decltype(x) slope)
                          HWY_ATTR { return hn::Add(m(row, column), hn::Mul(slope, m(row, 2))); };
    auto const zx = step(2, 0, slope_x), zy = step(2, 1, slope_y);
    auto ux = step(0, 0, slope_x), uy = step(0, 1, slope_y), vx = step(1, 0, slope_x), vy = step(1, 1, slope_y);
    if (t.perspective != 0) {
      ux = hn::Mul(hn::Sub(ux, hn::Mul(u, zx)), per_z);
      uy = hn::Mul(hn::Sub(uy, hn::Mul(u, zy)), per_z);
      vx = hn::Mul(hn::Sub(vx, hn::Mul(v, zx)), per_z);
      vy = hn::Mul(hn::Sub(vy, hn::Mul(v, zy)), per_z);
    }
    auto const area_signed = hn::Sub(hn::Mul(ux, vy), hn::Mul(uy, vx));
    auto const stamp = hn::Abs(area_signed);
    if (t.facing != 0) valid = hn::And(valid, hn::Gt(hn::Mul(area_signed, hn::Set(d, t.facing)), zero));
    auto const widest = hn::Set(d, t.widest);
    auto const least = hn::Set(d, t.least);
    auto const reach_u = hn::Min(widest, hn::Max(least, hn::Sqrt(hn::Add(hn::Mul(ux, ux), hn::Mul(uy, uy)))));
    auto const reach_v = hn::Min(widest, hn::Max(least, hn::Sqrt(hn::Add(hn::Mul(vx, vx), hn::Mul(vy, vy)))));
    valid = hn::And(valid, hn::Gt(hn::Add(u, reach_u), hn::Set(d, float(area.left))));
    valid = hn::And(valid, hn::Lt(hn::Sub(u, reach_u), hn::Set(d, float(area.right - 1))));
    valid = hn::And(valid, hn::Gt(hn::Add(v, reach_v), hn::Set(d, float(area.top))));
    valid = hn::And(valid, hn::Lt(hn::Sub(v, reach_v), hn::Set(d, float(area.bottom - 1))));
    if (hn::AllFalse(d, valid)) continue;
    auto const color = hn::LoadU(du, pixels.color + i);
    auto const channel = [&](auto bits) HWY_ATTR {
      auto const root = hn::ConvertTo(d, hn::BitCast(di, hn::And(bits, hn::Set(du, 255))));
      return hn::Mul(hn::Mul(root, root), hn::Set(d, 1.0F / (255.0F * 255.0F)));
    };
    auto const alpha = hn::Mul(hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<24>(color))), hn::Set(d, 1.0F / 255));
    auto const weight = hn::Mul(alpha, hn::Min(one, hn::Div(stamp, hn::Mul(reach_u, reach_v))));
    // Gradient on the screen of the key, whose change with x is −zx / z² (perspective) or −zx.
    auto const per_z2 = hn::Mul(per_z, per_z);
    auto const per_area = hn::Div(one, hn::IfThenElse(hn::Gt(stamp, hn::Set(d, 1e-6F)), area_signed, one));
    auto const kx = hn::Neg(hn::Mul(zx, per_z2)), ky = hn::Neg(hn::Mul(zy, per_z2));
    auto key_u = hn::Mul(hn::Sub(hn::Mul(kx, vy), hn::Mul(ky, vx)), per_area);
    auto key_v = hn::Mul(hn::Sub(hn::Mul(ky, ux), hn::Mul(kx, uy)), per_area);
    auto const key = t.perspective != 0 ? per_z : hn::Neg(depth);
    // A surface that is seen from a grazing angle has many depths in a pixel; never more than a fifth of its own.
    auto tolerance = hn::Mul(hn::Set(d, t.tolerance), per_z2);
    auto const slant = hn::Mul(half, hn::Add(hn::Abs(key_u), hn::Abs(key_v)));
    auto const most = hn::Max(tolerance, hn::Mul(hn::Set(d, 0.2F), hn::Abs(key)));
    auto const limit = hn::Div(most, hn::Max(slant, most));
    key_u = hn::Mul(key_u, limit);
    key_v = hn::Mul(key_v, limit);
    tolerance = hn::Add(tolerance, hn::Mul(slant, limit));
    hn::Store(u, d, s.u);
    hn::Store(v, d, s.v);
    hn::Store(key, d, s.key);
    hn::Store(key_u, d, s.key_u);
    hn::Store(key_v, d, s.key_v);
    hn::Store(reach_u, d, s.reach_u);
    hn::Store(reach_v, d, s.reach_v);
    hn::Store(weight, d, s.weight);
    hn::Store(channel(color), d, s.red);
    hn::Store(channel(hn::ShiftRight<8>(color)), d, s.green);
    hn::Store(channel(hn::ShiftRight<16>(color)), d, s.blue);
    hn::Store(tolerance, d, s.tolerance);
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, valid, bytes);
    std::uint32_t bits = std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8;
    for (; bits != 0; bits &= bits - 1) {
      DrawSplat(s, static_cast<std::size_t>(__builtin_ctz(bits)), area, t.fills != 0);
      ++drawn;
    }
  }
  return drawn;
}

}  // namespace HWY_NAMESPACE
}  // namespace scanview
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scanview {

HWY_EXPORT(DrawSplats);

std::size_t draw_splats(LdiPixels const& pixels, std::size_t first, std::size_t count, SplatTransform const& transform,
                        OutputArea const& area) {
  return HWY_DYNAMIC_DISPATCH(DrawSplats)(pixels, first, count, transform, area);
}

namespace {

/// What coverage a sum of weights is: kernels that are not those of the grid do not add up to 1 everywhere.
constexpr float kGain = 1.25F;

struct Mixed {
  float red = 0, green = 0, blue = 0, left = 1, key = 0, most = 0;
  void add(OutputLayer const& layer) {
    float const coverage = std::min(1.0F, kGain * layer.sums[3]), share = left * coverage;
    float const scale = share / layer.sums[3];
    red += scale * layer.sums[0];
    green += scale * layer.sums[1];
    blue += scale * layer.sums[2];
    left -= share;
    if (share > most) most = share, key = layer.key;
  }
};

}  // namespace

void compose_splats(OutputArea const& area, OutputArea const* more, int y, int begin, int end, ComposedPixel* out) {
  for (int x = begin; x < end; ++x) {
    std::size_t const at = static_cast<std::size_t>(y - area.top) * static_cast<std::size_t>(area.stride) +
                           static_cast<std::size_t>(x - area.left);
    Mixed mixed;
    int const count = area.counts[at], others = more != nullptr ? more->counts[at] : 0;
    for (int k = 0, j = 0; (k < count || j < others) && mixed.left > 0.002F;) {
      bool const from_first = j >= others || (k < count && area.layers[k][at].key >= more->layers[j][at].key);
      OutputLayer layer = from_first ? area.layers[k++][at] : more->layers[j++][at];
      // The other buffer's next one may be the same surface.
      if (j < others && from_first) {
        OutputLayer const& next = more->layers[j][at];
        if (layer.key - next.key <= std::max(layer.tolerance, next.tolerance)) {
          for (int c = 0; c < 4; ++c) layer.sums[c] += next.sums[c];
          ++j;
        }
      } else if (k < count && !from_first) {
        OutputLayer const& next = area.layers[k][at];
        if (layer.key - next.key <= std::max(layer.tolerance, next.tolerance)) {
          for (int c = 0; c < 4; ++c) layer.sums[c] += next.sums[c];
          ++k;
        }
      }
      mixed.add(layer);
    }
    out[x - begin] = {mixed.red, mixed.green, mixed.blue, 1 - mixed.left, mixed.key};
  }
}

}  // namespace scanview
#endif
