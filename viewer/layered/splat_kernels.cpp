#include "viewer/layered/splat_kernels.h"

#include <algorithm>
#include <cmath>

#include "viewer/raster/encode_table.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/layered/splat_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace scanview {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;

constexpr std::size_t kGroup = 16;  // of splats that are drawn together

/// What is known of a group of splats.
struct alignas(64) Splats {
  float u[16], v[16], key[16], key_u[16], key_v[16], reach_u[16], reach_v[16], weight[16], red[16], green[16], blue[16],
      tolerance[16];
  // Of those that reach less than a pixel: the upper left one of the four pixels around, and weights along x and y.
  float left_weight[16], right_weight[16], top_weight[16], bottom_weight[16];
  std::int32_t x[16], y[16];
};

/// Cosines: what a surface covers at least whose normal is in doubt, and how far it may be turned away.
constexpr float kDoubtedCover = 0.35F, kDoubtedTurn = 0.2F;
/// How much wider splats of uncertain depths are.
constexpr float kDoubtedReach = 2;
/// Whatever is behind so much is not seen.
constexpr float kOpaque = 0.8F;
/// A patch is drawn on nothing that is covered so much by another surface.
constexpr float kFilled = 0.7F;

/// All eight numbers of an OutputLayer as one vector, whatever the instruction set: what is stored by parts is not at
/// hand as a whole.
typedef float Eight __attribute__((vector_size(32)));

struct Sample {
  Eight sums;  ///< of OutputLayer, for weight 1; the tolerance 0
  float key, tolerance;
};

HWY_INLINE void AddTo(OutputLayer& layer, Sample const& sample, float weight) {
  Eight value;
  __builtin_memcpy(&value, &layer, sizeof value);
  value += sample.sums * weight;
  __builtin_memcpy(&layer, &value, sizeof value);
}

HWY_INLINE void Join(OutputLayer& layer, OutputLayer const& other) {
  for (int c = 0; c < OutputLayer::kSums; ++c) layer.sums[c] += other.sums[c];
}

HWY_INLINE void PutSample(OutputLayer& layer, Sample const& sample, float weight) {
  Eight const value = sample.sums * weight;
  __builtin_memcpy(&layer, &value, sizeof value);
  layer.tolerance = sample.tolerance;
}

/// What the pixel at `at` makes of a sample, where its first layer is not simply the sample's.
template <bool kFills>
HWY_NOINLINE void AddBehind(OutputArea const& area, std::size_t at, Sample const& sample, float weight) {
  int const count = area.counts[at];
  for (int k = 0; k < count; ++k) {
    OutputLayer& layer = area.layers[k][at];
    float const covered = layer.sums[OutputLayer::weight];
    float const nearer = sample.key * covered - layer.sums[OutputLayer::key];
    if (std::abs(nearer) <= std::max(sample.tolerance, layer.tolerance) * covered) {
      AddTo(layer, sample, kFills ? std::min(weight, std::max(0.0F, 1 - covered)) : weight);
      return;
    }
    if (kFills && covered >= kFilled) return;
    if (nearer > 0) {
      int const last = std::min(count, kOutputLayers - 1);
      if (count == kOutputLayers && k < last) Join(area.layers[last - 1][at], area.layers[last][at]);
      for (int j = last; j > k; --j) area.layers[j][at] = area.layers[j - 1][at];
      PutSample(layer, sample, weight);
      area.counts[at] = static_cast<std::uint8_t>(last + 1);
      return;
    }
    if (covered >= kOpaque) return;
  }
  if (count == kOutputLayers) {
    // Where noise makes many thin layers of a surface, none of what covers the pixel is lost.
    AddTo(area.layers[kOutputLayers - 1][at], sample, weight);
    return;
  }
  PutSample(area.layers[count][at], sample, weight);
  area.counts[at] = static_cast<std::uint8_t>(count + 1);
}

template <bool kFills>
HWY_INLINE void AddSample(OutputArea const& area, std::size_t at, Sample const& sample, float weight) {
  if (area.counts[at] != 0) {
    OutputLayer& layer = area.layers[0][at];
    float const covered = layer.sums[OutputLayer::weight];
    float const nearer = sample.key * covered - layer.sums[OutputLayer::key];
    if (std::abs(nearer) <= std::max(sample.tolerance, layer.tolerance) * covered) {
      AddTo(layer, sample, kFills ? std::min(weight, std::max(0.0F, 1 - covered)) : weight);
      return;
    }
    if (kFills && covered >= kFilled) return;
    if (nearer < 0 && covered >= kOpaque) return;
  }
  AddBehind<kFills>(area, at, sample, weight);
}

/// A sample whose depth follows the tangent plane along a row.
struct RowSample {
  Sample sample;
  Eight step;
  float key_step;
  HWY_INLINE RowSample(Splats const& s, std::size_t i, float key) : key_step(s.key_u[i]) {
    Eight const sums = {s.red[i], s.green[i], s.blue[i], 1, key, 0, 0, 0};
    Eight const along = {0, 0, 0, 0, key_step, 0, 0, 0};
    sample.sums = sums;
    sample.key = key;
    sample.tolerance = s.tolerance[i];
    step = along;
  }
  HWY_INLINE void Next() {
    sample.sums += step;
    sample.key += key_step;
  }
};

/// A splat on the pixels around it that are within its reach.
template <bool kFills, bool kStencil>
HWY_INLINE void DrawWide(Splats const& s, std::size_t i, OutputArea const& area) {
  float const u = s.u[i], v = s.v[i], reach_u = s.reach_u[i], reach_v = s.reach_v[i];
  int const left = std::max(area.first_x, static_cast<int>(std::ceil(u - reach_u))),
            right = std::min(area.end_x - 1, static_cast<int>(std::floor(u + reach_u)));
  int const top = std::max(area.first_y, static_cast<int>(std::ceil(v - reach_v))),
            bottom = std::min(area.end_y - 1, static_cast<int>(std::floor(v + reach_v)));
  if (left > right) return;
  float const per_u = 1 / reach_u, per_v = 1 / reach_v, weight = s.weight[i], first = float(left) - u;
  for (int y = top; y <= bottom; ++y) {
    float const dy = float(y) - v;
    float const row_weight = weight * (1 - std::abs(dy) * per_v);
    std::size_t const row = static_cast<std::size_t>(y - area.top);
    std::size_t at = row * static_cast<std::size_t>(area.stride) + static_cast<std::size_t>(left - area.left);
    std::uint8_t const* stencil =
        kStencil ? area.stencil + row * static_cast<std::size_t>(area.right - area.left) + (left - area.left) : nullptr;
    RowSample along(s, i, s.key[i] + dy * s.key_v[i] + first * s.key_u[i]);
    float dx = first;
    for (int x = left; x <= right; ++x, ++at, dx += 1, along.Next()) {
      float const w = row_weight * (1 - std::abs(dx) * per_u);
      if (kStencil && *stencil++ == 0) continue;
      if (w > 0) AddSample<kFills>(area, at, along.sample, w);
    }
  }
}

/// A splat that reaches less than a pixel, away from the area's upper and lower border.
template <bool kFills>
HWY_INLINE void DrawSmall(Splats const& s, std::size_t i, OutputArea const& area) {
  std::ptrdiff_t const at = std::ptrdiff_t{s.y[i] - area.top} * area.stride + (s.x[i] - area.left);
  float const key = s.key[i] + (float(s.x[i]) - s.u[i]) * s.key_u[i] + (float(s.y[i]) - s.v[i]) * s.key_v[i];
  float const left = s.left_weight[i], right = s.right_weight[i];
  auto const row = [&](std::ptrdiff_t place, float weight, float row_key) HWY_ATTR {
    if (!(weight > 0)) return;
    RowSample along(s, i, row_key);
    if (left > 0) AddSample<kFills>(area, static_cast<std::size_t>(place), along.sample, weight * left);
    if (!(right > 0)) return;
    along.Next();
    AddSample<kFills>(area, static_cast<std::size_t>(place + 1), along.sample, weight * right);
  };
  row(at, s.top_weight[i], key);
  row(at + area.stride, s.bottom_weight[i], key + s.key_v[i]);
}

template <bool kFills, bool kStencil>
HWY_INLINE void DrawAll(Splats const& s, std::uint32_t small, std::uint32_t wide, OutputArea const& area) {
  for (; small != 0; small &= small - 1) DrawSmall<kFills>(s, static_cast<std::size_t>(__builtin_ctz(small)), area);
  for (; wide != 0; wide &= wide - 1)
    DrawWide<kFills, kStencil>(s, static_cast<std::size_t>(__builtin_ctz(wide)), area);
}

/// A bit a lane.
template <class D, class Mask>
HWY_INLINE std::uint32_t MaskBits(D d, Mask mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(d, mask, bytes);
  return std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8;
}

/// Those of a group that are to be drawn, a bit each: such that reach less than a pixel, and others.
struct Drawn {
  std::uint32_t small = 0, wide = 0;
};

/// Places a vector of pixels, of which `count` are there, from `lane` of the group on.
HWY_INLINE Drawn PlaceSplats(LdiPixels const& pixels, std::size_t i, std::size_t count, SplatTransform const& t,
                             OutputArea const& area, std::size_t lane, Splats& s) {
  Floats const d;
  hn::Rebind<std::int32_t, Floats> const di;
  hn::Rebind<std::uint32_t, Floats> const du;
  hn::Rebind<std::uint8_t, Floats> const du8;
  hn::Rebind<std::int8_t, Floats> const di8;
  hn::Rebind<std::uint16_t, Floats> const du16;
  auto const one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F), zero = hn::Zero(d);
  auto const m = [&](int row, int column) HWY_ATTR { return hn::Set(d, t.rows[row][column]); };
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
  auto valid = hn::FirstN(d, count);
  auto per_z = one;
  if (t.perspective) {
    valid = hn::And(valid, hn::Gt(depth, hn::Set(d, t.near)));
    per_z = hn::Div(one, hn::Max(depth, hn::Set(d, t.near)));
  }
  auto const u = hn::Mul(pu, per_z), v = hn::Mul(pv, per_z);
  // How the screen moves with a grid step along x and along y on the tangent plane.
  auto const step = [&](int row, int column, decltype(x) slope)
                        HWY_ATTR { return hn::Add(m(row, column), hn::Mul(slope, m(row, 2))); };
  auto zx = step(2, 0, slope_x), zy = step(2, 1, slope_y);
  auto ux = step(0, 0, slope_x), uy = step(0, 1, slope_y), vx = step(1, 0, slope_x), vy = step(1, 1, slope_y);
  if (t.perspective) {
    ux = hn::Mul(hn::Sub(ux, hn::Mul(u, zx)), per_z);
    uy = hn::Mul(hn::Sub(uy, hn::Mul(u, zy)), per_z);
    vx = hn::Mul(hn::Sub(vx, hn::Mul(v, zx)), per_z);
    vy = hn::Mul(hn::Sub(vy, hn::Mul(v, zy)), per_z);
  }
  auto const square = hn::Mul(hn::Set(d, t.step), per_z);
  if (t.facing == 0) {
    ux = vy = square;
    uy = vx = zx = zy = zero;
  }
  auto const area_signed = hn::Sub(hn::Mul(ux, vy), hn::Mul(uy, vx));
  // Where in doubt, a surface is seen though it is turned away a little, and covers as much as one that is not.
  auto const facing_area = hn::Mul(hn::Mul(square, square), hn::Set(d, t.doubt));
  auto const stamp = hn::Max(hn::Abs(area_signed), hn::Mul(facing_area, hn::Set(d, kDoubtedCover)));
  if (t.facing != 0)
    valid = hn::And(valid, hn::Gt(hn::Add(hn::Mul(area_signed, hn::Set(d, t.facing)),
                                          hn::Mul(facing_area, hn::Set(d, kDoubtedTurn))),
                                  zero));
  auto const widest = hn::Set(d, t.widest);
  auto const least = hn::Set(d, t.least);
  auto reach_u = hn::Min(widest, hn::Max(least, hn::Sqrt(hn::Add(hn::Mul(ux, ux), hn::Mul(uy, uy)))));
  auto reach_v = hn::Min(widest, hn::Max(least, hn::Sqrt(hn::Add(hn::Mul(vx, vx), hn::Mul(vy, vy)))));
  auto const share = hn::Min(one, hn::Div(stamp, hn::Mul(reach_u, reach_v)));
  if (t.doubt != 0) {
    // Noise has moved what lies around, too: whole surfaces must not have holes.
    reach_u = hn::Mul(reach_u, hn::Set(d, kDoubtedReach));
    reach_v = hn::Mul(reach_v, hn::Set(d, kDoubtedReach));
  }
  valid = hn::And(valid, hn::Gt(hn::Add(u, reach_u), hn::Set(d, float(area.first_x))));
  valid = hn::And(valid, hn::Lt(hn::Sub(u, reach_u), hn::Set(d, float(area.end_x - 1))));
  valid = hn::And(valid, hn::Gt(hn::Add(v, reach_v), hn::Set(d, float(area.first_y))));
  valid = hn::And(valid, hn::Lt(hn::Sub(v, reach_v), hn::Set(d, float(area.end_y - 1))));
  if (hn::AllFalse(d, valid)) return {};
  auto const color = hn::LoadU(du, pixels.color + i);
  auto const channel = [&](auto bits) HWY_ATTR {
    auto const root = hn::ConvertTo(d, hn::BitCast(di, hn::And(bits, hn::Set(du, 255))));
    return hn::Mul(hn::Mul(root, root), hn::Set(d, 1.0F / (255.0F * 255.0F)));
  };
  auto const alpha = hn::Mul(hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<24>(color))), hn::Set(d, 1.0F / 255));
  auto const weight = hn::Mul(alpha, share);
  // Gradient on the screen of the key, whose change with x is −zx / z² (perspective) or −zx.
  auto const per_z2 = hn::Mul(per_z, per_z);
  auto const per_area = hn::Div(one, hn::IfThenElse(hn::Gt(stamp, hn::Set(d, 1e-6F)), area_signed, one));
  auto const kx = hn::Neg(hn::Mul(zx, per_z2)), ky = hn::Neg(hn::Mul(zy, per_z2));
  auto key_u = hn::Mul(hn::Sub(hn::Mul(kx, vy), hn::Mul(ky, vx)), per_area);
  auto key_v = hn::Mul(hn::Sub(hn::Mul(ky, ux), hn::Mul(kx, uy)), per_area);
  auto const key = t.perspective ? per_z : hn::Neg(depth);
  // A surface that is seen from a grazing angle has many depths in a pixel; never more than a fifth of its own.
  auto const fifth = t.perspective ? hn::Mul(hn::Set(d, 0.2F), hn::Abs(key)) : hn::Set(d, t.deepest);
  auto tolerance = hn::Mul(hn::Set(d, t.tolerance), per_z2);
  auto const slant = hn::Mul(half, hn::Add(hn::Abs(key_u), hn::Abs(key_v)));
  auto const most = hn::Max(tolerance, fifth);
  auto const limit = hn::Div(most, hn::Max(slant, most));
  key_u = hn::Mul(key_u, limit);
  key_v = hn::Mul(key_v, limit);
  tolerance = hn::Add(tolerance, hn::Mul(slant, limit));
  if (t.perspective) {
    // Beyond a tangent plane's horizon there is no depth: over all of a splat it is at most doubled.
    auto const rise = hn::Add(hn::Mul(hn::Abs(key_u), reach_u), hn::Mul(hn::Abs(key_v), reach_v));
    auto const half_key = hn::Mul(half, key);
    auto const share = hn::Div(half_key, hn::Max(rise, half_key));
    key_u = hn::Mul(key_u, share);
    key_v = hn::Mul(key_v, share);
  }
  hn::Store(u, d, s.u + lane);
  hn::Store(v, d, s.v + lane);
  hn::Store(key, d, s.key + lane);
  hn::Store(key_u, d, s.key_u + lane);
  hn::Store(key_v, d, s.key_v + lane);
  hn::Store(channel(color), d, s.red + lane);
  hn::Store(channel(hn::ShiftRight<8>(color)), d, s.green + lane);
  hn::Store(channel(hn::ShiftRight<16>(color)), d, s.blue + lane);
  hn::Store(tolerance, d, s.tolerance + lane);
  // A padded buffer takes what is beside a row; what is above or below is another's.
  auto const floor_u = hn::Floor(u), floor_v = hn::Floor(v);
  auto small = hn::And(hn::Lt(reach_u, one), hn::Lt(reach_v, one));
  small = hn::And(small, hn::And(hn::Ge(floor_v, hn::Set(d, float(area.top))),
                                 hn::Lt(floor_v, hn::Set(d, float(area.bottom - 1)))));
  std::uint32_t small_bits = area.stencil == nullptr ? MaskBits(d, hn::And(small, valid)) : 0;
  std::uint32_t wide_bits = MaskBits(d, valid) & ~small_bits;
  if (small_bits != 0) {
    auto const per_u = hn::Div(one, reach_u), per_v = hn::Div(one, reach_v);
    auto const right = hn::Sub(u, floor_u), lower = hn::Sub(v, floor_v);
    auto const tent = [&](auto away, auto per) HWY_ATTR { return hn::Max(zero, hn::Sub(one, hn::Mul(away, per))); };
    hn::Store(tent(right, per_u), d, s.left_weight + lane);
    hn::Store(tent(hn::Sub(one, right), per_u), d, s.right_weight + lane);
    hn::Store(hn::Mul(weight, tent(lower, per_v)), d, s.top_weight + lane);
    hn::Store(hn::Mul(weight, tent(hn::Sub(one, lower), per_v)), d, s.bottom_weight + lane);
    hn::Store(hn::ConvertTo(di, floor_u), di, s.x + lane);
    hn::Store(hn::ConvertTo(di, floor_v), di, s.y + lane);
  }
  if (wide_bits != 0) {
    hn::Store(reach_u, d, s.reach_u + lane);
    hn::Store(reach_v, d, s.reach_v + lane);
    hn::Store(weight, d, s.weight + lane);
  }
  return {small_bits << lane, wide_bits << lane};
}

std::size_t DrawSplats(LdiPixels const& pixels, std::size_t first, std::size_t count, SplatTransform const& t,
                       OutputArea const& area) {
  std::size_t const lanes = hn::Lanes(Floats());
  std::size_t drawn = 0;
  Splats s;
  // The order of splats counts, in which small ones come first: groups are as large whatever a vector holds.
  for (std::size_t k = 0; k < count; k += kGroup) {
    Drawn group;
    for (std::size_t lane = 0; lane < kGroup && k + lane < count; lane += lanes) {
      Drawn const some = PlaceSplats(pixels, first + k + lane, count - k - lane, t, area, lane, s);
      group.small |= some.small;
      group.wide |= some.wide;
    }
    drawn += static_cast<std::size_t>(__builtin_popcount(group.small | group.wide));
    if (area.stencil != nullptr) {
      DrawAll<false, true>(s, group.small, group.wide, area);
    } else if (t.fills) {
      DrawAll<true, false>(s, group.small, group.wide, area);
    } else {
      DrawAll<false, false>(s, group.small, group.wide, area);
    }
  }
  return drawn;
}

/// What coverage a sum of weights is: kernels that are not those of the grid do not add up to 1 everywhere.
constexpr float kGain = 1.25F;
/// What is left to be seen below this is nothing.
constexpr float kNothing = 0.002F;

/// Whether a pixel's first layer goes on in all pixels beside it: then it is whole, though kernels on a grid that is
/// turned or foreshortened may not add up to 1 there. What is in another area does not count.
HWY_INLINE bool IsWithin(OutputArea const& area, std::size_t at, int x, int y) {
  OutputLayer const& here = area.layers[0][at];
  float const weight = here.sums[OutputLayer::weight];
  // Beyond an outline weights fall off within a pixel or two.
  constexpr float kInner = 0.35F;
  if (weight < kInner) return false;
  auto const goes_on = [&](bool is_there, std::ptrdiff_t step) {
    if (!is_there) return true;
    std::size_t const other = static_cast<std::size_t>(static_cast<std::ptrdiff_t>(at) + step);
    if (area.counts[other] == 0) return false;
    OutputLayer const& layer = area.layers[0][other];
    float const other_weight = layer.sums[OutputLayer::weight];
    if (other_weight < kInner) return false;
    // Tolerances are of depths within half a pixel.
    float const most = 2 * std::max(here.tolerance, layer.tolerance);
    return std::abs(here.sums[OutputLayer::key] * other_weight - layer.sums[OutputLayer::key] * weight) <=
           most * weight * other_weight;
  };
  return goes_on(x > area.left, -1) && goes_on(x + 1 < area.right, 1) && goes_on(y > area.top, -area.stride) &&
         goes_on(y + 1 < area.bottom, area.stride);
}

struct Mixed {
  float sums[8] = {};  ///< of OutputLayer, as shares
  float left = 1, most = 0, key = 0;
  HWY_INLINE void Add(OutputLayer const& layer, float gain = kGain) {
    float const weight = layer.sums[OutputLayer::weight];
    float const share = left * std::min(1.0F, gain * weight), scale = share / weight;
    for (int c = 0; c < 4; ++c) sums[c] += scale * layer.sums[c];
    left -= share;
    if (share > most) most = share, key = layer.sums[OutputLayer::key] / weight;
  }
};

/// Layers of one pixel of two buffers, near to far, what is the same surface in both as one.
class MergedLayers {
 public:
  MergedLayers(OutputArea const& first, OutputArea const& second, std::size_t at)
      : areas_{&first, &second}, counts_{first.counts[at], second.counts[at]}, at_(at) {}

  bool Next(OutputLayer* layer) {
    bool const has[2] = {next_[0] < counts_[0], next_[1] < counts_[1]};
    if (!has[0] && !has[1]) return false;
    int const nearer = !has[1] || (has[0] && Key(Here(0)) >= Key(Here(1))) ? 0 : 1, other = 1 - nearer;
    *layer = Here(nearer);
    ++next_[nearer];
    if (!has[other]) return true;
    OutputLayer const& same = Here(other);
    if (Key(*layer) - Key(same) > std::max(layer->tolerance, same.tolerance)) return true;
    for (int c = 0; c < OutputLayer::kSums; ++c) layer->sums[c] += same.sums[c];
    ++next_[other];
    return true;
  }

 private:
  OutputLayer const& Here(int which) const { return areas_[which]->layers[next_[which]][at_]; }
  static float Key(OutputLayer const& layer) { return layer.sums[OutputLayer::key] / layer.sums[OutputLayer::weight]; }
  OutputArea const* areas_[2];
  int counts_[2], next_[2] = {0, 0};
  std::size_t at_;
};

std::size_t ComposeSplats(OutputArea const& area, OutputArea const* more, int y, int begin, int end, bool perspective,
                          std::uint32_t least_alpha, std::uint32_t const* encode, float encode_steps,
                          PictureRow const& out) {
  Floats const d;
  hn::Rebind<std::int32_t, Floats> const di;
  hn::Rebind<std::uint32_t, Floats> const du;
  int const lanes = static_cast<int>(hn::Lanes(d));
  std::size_t const row = static_cast<std::size_t>(y - area.top) * static_cast<std::size_t>(area.stride);
  std::uint8_t const* const stencil =
      area.stencil == nullptr
          ? nullptr
          : area.stencil + static_cast<std::size_t>(y - area.top) * static_cast<std::size_t>(area.right - area.left);
  alignas(64) float red[16], green[16], blue[16], coverage[16], depth[16];
  alignas(64) std::uint32_t pixels[16];
  std::size_t bare = 0;
  float const missing = std::nanf("");
  for (int x = begin; x < end; x += lanes) {
    int const count = std::min(lanes, end - x);
    for (int i = 0; i < lanes; ++i) {
      red[i] = green[i] = blue[i] = coverage[i] = 0;
      depth[i] = missing;
      if (i >= count) continue;
      std::size_t const at = row + static_cast<std::size_t>(x + i - area.left);
      Mixed mixed;
      if (more != nullptr && more->counts[at] != 0) {
        MergedLayers layers(area, *more, at);
        OutputLayer layer;
        while (mixed.left > kNothing && layers.Next(&layer)) mixed.Add(layer);
      } else {
        int const layers = area.counts[at];
        for (int k = 0; k < layers && mixed.left > kNothing; ++k) {
          OutputLayer const& layer = area.layers[k][at];
          float const weight = layer.sums[OutputLayer::weight];
          bool const is_whole = k == 0 && kGain * weight < 1 && IsWithin(area, at, x + i, y);
          mixed.Add(layer, is_whole ? 1 / weight : kGain);
        }
      }
      if (!(mixed.most > 0)) continue;
      coverage[i] = 1 - mixed.left;
      red[i] = mixed.sums[0];
      green[i] = mixed.sums[1];
      blue[i] = mixed.sums[2];
      depth[i] = mixed.key;
    }
    auto const cover = hn::Load(d, coverage);
    auto const scale = hn::Div(hn::Set(d, 1.0F), hn::Max(cover, hn::Set(d, 1e-6F)));
    auto const half = hn::Set(d, 0.5F);
    auto const code = [&](float const* sums) HWY_ATTR {
      auto const linear = hn::Min(hn::Set(d, 1.0F), hn::Mul(hn::Load(d, sums), scale));
      auto const step = hn::ConvertTo(di, hn::Add(hn::Mul(hn::Sqrt(linear), hn::Set(d, encode_steps)), half));
      return hn::GatherIndex(du, encode, step);
    };
    auto const alpha = hn::BitCast(du, hn::ConvertTo(di, hn::Add(hn::Mul(cover, hn::Set(d, 255.0F)), half)));
    auto const bgra = hn::Or(hn::Or(code(blue), hn::ShiftLeft<8>(code(green))),
                             hn::Or(hn::ShiftLeft<16>(code(red)), hn::ShiftLeft<24>(alpha)));
    hn::Store(hn::IfThenElseZero(hn::Ne(alpha, hn::Zero(du)), bgra), du, pixels);
    auto const key = hn::Load(d, depth);
    hn::Store(perspective ? hn::Div(hn::Set(d, 1.0F), key) : hn::Neg(key), d, depth);
    for (int i = 0; i < count; ++i) {
      if (stencil != nullptr && stencil[x + i - area.left] == 0) continue;
      bare += pixels[i] >> 24 < least_alpha;
      if (stencil != nullptr && pixels[i] == 0) continue;
      out.color[x + i] = pixels[i];
      out.depth[x + i] = pixels[i] == 0 ? missing : depth[i];
    }
  }
  return bare;
}

}  // namespace HWY_NAMESPACE
}  // namespace scanview
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scanview {

HWY_EXPORT(DrawSplats);
HWY_EXPORT(ComposeSplats);

std::size_t draw_splats(LdiPixels const& pixels, std::size_t first, std::size_t count, SplatTransform const& transform,
                        OutputArea const& area) {
  return HWY_DYNAMIC_DISPATCH(DrawSplats)(pixels, first, count, transform, area);
}

std::size_t compose_splats(OutputArea const& area, OutputArea const* more, int y, int begin, int end, bool perspective,
                           std::uint32_t least_alpha, PictureRow const& out) {
  return HWY_DYNAMIC_DISPATCH(ComposeSplats)(area, more, y, begin, end, perspective, least_alpha, encode_table().data(),
                                             float(kEncodeSteps), out);
}

}  // namespace scanview
#endif
