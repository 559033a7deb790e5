#include <hwy/aligned_allocator.h>

#include <algorithm>
#include <cfloat>
#include <limits>
#include <type_traits>

#include "viewer/raster/encode_table.h"
#include "viewer/raster/kernels.h"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/raster/compose_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace scanview {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using Words = hn::RebindToUnsigned<Floats>;
using V = hn::Vec<Floats>;
constexpr int kMostLanes = 16;

HWY_INLINE V Clamp(V x, float low, float high) {
  Floats const d;
  return hn::Min(hn::Max(x, hn::Set(d, low)), hn::Set(d, high));
}

/// Which texels lie around a place, and how far between them; clamped to the edge.
struct Taps {
  hn::Vec<Ints> x, y;
  V right, down;  ///< shares of the neighbours
};

HWY_INLINE Taps TapsAt(V s, V t, float scale_s, float scale_t, int width, int height) {
  Floats const d;
  Ints const di;
  auto const half = hn::Set(d, 0.5F);
  auto const x = Clamp(hn::Sub(hn::Mul(s, hn::Set(d, scale_s)), half), 0.0F, static_cast<float>(width - 1));
  auto const y = Clamp(hn::Sub(hn::Mul(t, hn::Set(d, scale_t)), half), 0.0F, static_cast<float>(height - 1));
  auto const left = hn::Floor(x), top = hn::Floor(y);
  return {hn::ConvertTo(di, left), hn::ConvertTo(di, top), hn::Sub(x, left), hn::Sub(y, top)};
}

void MeasureQuality(ComposedLayer const& layer, Composition const& how, TileArea const& area) {
  Floats const d;
  Ints const di;
  Words const du;
  std::size_t const lanes = hn::Lanes(d);
  int const rows = area.bottom - area.top, columns = area.right - area.left;
  TextureLevel const& level = layer.texture->levels.front();
  auto const byte = [&](hn::Vec<Words> word, auto shift) HWY_ATTR {
    return hn::ConvertTo(d, hn::BitCast(di, hn::And(hn::ShiftRight<decltype(shift)::value>(word), hn::Set(du, 255))));
  };
  for (int y = 0; y < rows; ++y) {
    for (std::size_t x = 0; x < static_cast<std::size_t>(columns); x += lanes) {
      std::size_t const at = static_cast<std::size_t>(y * kTileStride) + x;
      auto const key = hn::LoadU(d, layer.samples.key + at);
      auto drawn = hn::And(hn::Gt(key, hn::Set(d, -FLT_MAX)), hn::Lt(key, hn::Set(d, FLT_MAX)));
      if (layer.backs_hide) {
        auto const cosine = hn::ShiftRight<16>(hn::LoadU(du, layer.samples.packed + at));
        drawn = hn::AndNot(hn::RebindMask(d, hn::Eq(cosine, hn::Zero(du))), drawn);
      }
      if (hn::AllFalse(d, drawn)) {
        hn::StoreU(hn::Zero(d), d, layer.quality + at);
        hn::StoreU(hn::Zero(d), d, layer.fairness + at);
        continue;
      }
      auto quality = hn::Set(d, 1.0F);
      if (layer.cosine) {
        auto const cosine = hn::ShiftRight<16>(hn::LoadU(du, layer.samples.packed + at));
        quality = hn::Mul(hn::ConvertTo(d, hn::BitCast(di, cosine)), hn::Set(d, 1.0F / 65535));
      }
      auto const s = hn::IfThenElseZero(drawn, hn::LoadU(d, layer.samples.s + at));
      auto const t = hn::IfThenElseZero(drawn, hn::LoadU(d, layer.samples.t + at));
      Taps const taps = TapsAt(s, t, 1, 1, level.width, level.height);
      auto const index = hn::Add(hn::Mul(taps.y, hn::Set(di, level.width)), taps.x);
      auto const word = hn::GatherIndex(du, layer.texture->feather.data(), index);
      auto const mix = [&](V a, V b, V share) HWY_ATTR { return hn::Add(a, hn::Mul(share, hn::Sub(b, a))); };
      auto const upper =
          mix(byte(word, std::integral_constant<int, 0>()), byte(word, std::integral_constant<int, 8>()), taps.right);
      auto const lower =
          mix(byte(word, std::integral_constant<int, 16>()), byte(word, std::integral_constant<int, 24>()), taps.right);
      auto const feather = hn::Mul(mix(upper, lower, taps.down), hn::Set(d, 1.0F / 255));
      if (layer.feather) quality = hn::Mul(quality, feather);
      hn::StoreU(hn::IfThenElseZero(drawn, Clamp(quality, how.least_weight, 1.0F)), d, layer.quality + at);
      auto const fairness =
          hn::Sub(hn::Mul(hn::Mul(feather, feather), hn::Set(d, 1.0F / how.fair_feather)), hn::Set(d, 1.0F));
      hn::StoreU(hn::IfThenElseZero(drawn, Clamp(fairness, 0.0F, 1.0F)), d, layer.fairness + at);
    }
  }
}

struct Color {
  V r, g, b;
};

/// Linear light (times 1023²) of one level, bilinear.
HWY_INLINE Color SampleLevel(RasterTexture const& texture, std::size_t index, V s, V t) {
  Floats const d;
  Ints const di;
  Words const du;
  TextureLevel const& full = texture.levels.front();
  TextureLevel const& level = texture.levels[index];
  Taps const taps =
      TapsAt(s, t, static_cast<float>(level.width) / static_cast<float>(full.width),
             static_cast<float>(level.height) / static_cast<float>(full.height), level.width, level.height);
  auto const one = hn::Set(di, 1);
  auto const next_x = hn::Min(hn::Add(taps.x, one), hn::Set(di, level.width - 1));
  auto const next_y = hn::Min(hn::Add(taps.y, one), hn::Set(di, level.height - 1));
  auto const row = hn::Mul(taps.y, hn::Set(di, level.width)), next_row = hn::Mul(next_y, hn::Set(di, level.width));
  std::uint32_t const* const texels = texture.texels.data() + level.offset;
  auto const both = hn::Mul(taps.right, taps.down);
  auto const only_right = hn::Sub(taps.right, both), only_down = hn::Sub(taps.down, both);
  auto const none = hn::Sub(hn::Sub(hn::Set(d, 1.0F), taps.right), only_down);
  Color sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  auto const add = [&](hn::Vec<Ints> at, V share) HWY_ATTR {
    auto const texel = hn::GatherIndex(du, texels, at);
    auto const mask = hn::Set(du, 1023);
    auto const r = hn::ConvertTo(d, hn::BitCast(di, hn::And(texel, mask)));
    auto const g = hn::ConvertTo(d, hn::BitCast(di, hn::And(hn::ShiftRight<10>(texel), mask)));
    auto const b = hn::ConvertTo(d, hn::BitCast(di, hn::ShiftRight<20>(texel)));
    sum.r = hn::Add(sum.r, hn::Mul(share, hn::Mul(r, r)));
    sum.g = hn::Add(sum.g, hn::Mul(share, hn::Mul(g, g)));
    sum.b = hn::Add(sum.b, hn::Mul(share, hn::Mul(b, b)));
  };
  add(hn::Add(row, taps.x), none);
  add(hn::Add(row, next_x), only_right);
  add(hn::Add(next_row, taps.x), only_down);
  add(hn::Add(next_row, next_x), both);
  return sum;
}

/// Linear light of a layer's samples, trilinear; lanes without a sample give anything finite.
HWY_INLINE Color SampleLayer(ComposedLayer const& layer, std::size_t at, hn::Mask<Floats> wanted, V s, V t) {
  Floats const d;
  Ints const di;
  Words const du;
  s = hn::IfThenElseZero(wanted, s);
  t = hn::IfThenElseZero(wanted, t);
  auto const packed = hn::IfThenElseZero(hn::RebindMask(du, wanted), hn::LoadU(du, layer.samples.packed + at));
  auto const lod_bits = hn::And(packed, hn::Set(du, 32767));
  Color sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
  if (hn::AllTrue(du, hn::Eq(lod_bits, hn::Zero(du)))) {
    sum = SampleLevel(*layer.texture, 0, s, t);
  } else {
    // Levels have tent-shaped shares; neighbouring pixels need the same two or three.
    auto const lod = hn::Mul(hn::ConvertTo(d, hn::BitCast(di, lod_bits)), hn::Set(d, 1.0F / 2048));
    HWY_ALIGN float of_lane[kMostLanes];
    hn::Store(lod, d, of_lane);
    float least = FLT_MAX, most = 0;
    for (std::size_t i = 0; i < hn::Lanes(d); ++i) {
      least = std::min(least, of_lane[i]);
      most = std::max(most, of_lane[i]);
    }
    std::size_t const last = std::min(layer.texture->levels.size() - 1, static_cast<std::size_t>(most) + 1);
    for (std::size_t level = static_cast<std::size_t>(least); level <= last; ++level) {
      auto const share =
          hn::Max(hn::Zero(d), hn::Sub(hn::Set(d, 1.0F), hn::AbsDiff(lod, hn::Set(d, static_cast<float>(level)))));
      if (hn::AllFalse(d, hn::Gt(share, hn::Zero(d)))) continue;
      Color const color = SampleLevel(*layer.texture, level, s, t);
      sum.r = hn::Add(sum.r, hn::Mul(share, color.r));
      sum.g = hn::Add(sum.g, hn::Mul(share, color.g));
      sum.b = hn::Add(sum.b, hn::Mul(share, color.b));
    }
  }
  constexpr float kDecode = 1.0F / (1023.0F * 1023.0F);
  sum.r = hn::Mul(sum.r, hn::Set(d, layer.gain[0] * kDecode));
  sum.g = hn::Mul(sum.g, hn::Set(d, layer.gain[1] * kDecode));
  sum.b = hn::Mul(sum.b, hn::Set(d, layer.gain[2] * kDecode));
  if (layer.samples.lit) {
    auto const light = hn::IfThenElseZero(hn::RebindMask(du, wanted), hn::LoadU(du, layer.samples.light + at));
    auto const share = [&](hn::Vec<Words> bits) HWY_ATTR {
      return hn::Mul(hn::ConvertTo(d, hn::BitCast(di, hn::And(bits, hn::Set(du, 1023)))), hn::Set(d, 1.0F / 511.5F));
    };
    sum.r = hn::Mul(sum.r, share(light));
    sum.g = hn::Mul(sum.g, share(hn::ShiftRight<10>(light)));
    sum.b = hn::Mul(sum.b, share(hn::ShiftRight<20>(light)));
  }
  if (layer.samples.wireframe) {
    auto const line = hn::RebindMask(d, hn::Ne(hn::And(packed, hn::Set(du, 1U << 15)), hn::Zero(du)));
    sum.r = hn::IfThenElse(line, hn::Set(d, layer.hue[0]), sum.r);
    sum.g = hn::IfThenElse(line, hn::Set(d, layer.hue[1]), sum.g);
    sum.b = hn::IfThenElse(line, hn::Set(d, layer.hue[2]), sum.b);
  }
  return sum;
}

using Lanes = float[kMostLanes];

/// The samples of one group of pixels: compact, so that most groups cost as many layers as they have.
struct Group {
  std::size_t count = 0;
  std::size_t* layer;
  Lanes* quality;
  Lanes* fair_fill;  ///< the layer's fill times the sample's fairness
  Lanes* rank;       ///< its weight where it is decided what hides what
  Lanes* depth;
  Lanes* reliable;
  Lanes* seen;
  Lanes* share;
  V nearest, spread;  ///< depth of the nearest sample, and from there to the furthest

  /// indices: one a layer; scratch: seven arrays of kMostLanes floats a layer, aligned for vectors.
  Group(std::size_t layers, std::size_t* indices, float* scratch)
      : layer(indices), nearest(hn::Zero(Floats())), spread(nearest) {
    for (Lanes** const part : {&quality, &fair_fill, &rank, &depth, &reliable, &seen, &share}) {
      *part = reinterpret_cast<Lanes*>(scratch);
      scratch += layers * kMostLanes;
    }
  }
};

HWY_INLINE void GatherGroup(ComposedLayer const* layers, std::size_t count, Composition const& how, std::size_t at,
                            Group& group) {
  Floats const d;
  auto const one = hn::Set(d, 1.0F);
  auto nearest = hn::Set(d, FLT_MAX), furthest = hn::Set(d, -FLT_MAX);
  group.count = 0;
  for (std::size_t i = 0; i < count; ++i) {
    auto const quality = hn::LoadU(d, layers[i].quality + at);
    if (hn::AllFalse(d, hn::Gt(quality, hn::Zero(d)))) continue;
    auto const fairness = hn::LoadU(d, layers[i].fairness + at);
    auto const weight = hn::Set(d, layers[i].weight);
    auto const rank = hn::Mul(hn::Add(weight, hn::Mul(fairness, hn::Set(d, layers[i].fill_rank))), quality);
    auto const counts = hn::Gt(rank, hn::Zero(d));
    if (hn::AllFalse(d, counts)) continue;
    auto const key = hn::LoadU(d, layers[i].samples.key + at);
    auto const depth = how.perspective ? hn::Div(one, key) : hn::Neg(key);
    nearest = hn::IfThenElse(counts, hn::Min(nearest, depth), nearest);
    furthest = hn::IfThenElse(counts, hn::Max(furthest, depth), furthest);
    std::size_t const k = group.count++;
    group.layer[k] = i;
    hn::Store(hn::IfThenElseZero(counts, quality), d, group.quality[k]);
    hn::Store(hn::Mul(fairness, hn::Set(d, layers[i].fill)), d, group.fair_fill[k]);
    hn::Store(rank, d, group.rank[k]);
    hn::Store(hn::IfThenElseZero(counts, depth), d, group.depth[k]);
  }
  group.nearest = nearest;
  group.spread = hn::Sub(furthest, nearest);
}

/// How far each sample is reliable and not hidden.
HWY_INLINE void SoftZSeen(Composition const& how, Group& group) {
  Floats const d;
  auto const one = hn::Set(d, 1.0F);
  auto threshold = hn::Set(d, how.threshold), ramp = hn::Set(d, how.ramp);
  if (how.growth > 0 || how.parallax > 0) {
    auto const slope = hn::Add(hn::Set(d, how.growth), hn::Mul(hn::Set(d, how.parallax), group.nearest));
    threshold = hn::Add(threshold, hn::Mul(slope, group.nearest));
    ramp = hn::Div(hn::Set(d, 2.0F), hn::Max(threshold, hn::Set(d, 1e-30F)));
  }
  // Most pixels show one surface.
  if (hn::AllFalse(d, hn::Gt(group.spread, threshold))) {
    for (std::size_t k = 0; k < group.count; ++k) hn::Store(one, d, group.seen[k]);
    return;
  }
  auto const hide = [&](V distance) HWY_ATTR { return Clamp(hn::Mul(hn::Sub(distance, threshold), ramp), 0.0F, 1.0F); };
  for (std::size_t i = 0; i < group.count; ++i) {
    auto const rank = hn::Load(d, group.rank[i]), depth = hn::Load(d, group.depth[i]);
    auto doubt = hn::Zero(d);
    for (std::size_t j = 0; j < group.count; ++j) {
      auto const hidden = hide(hn::Sub(hn::Load(d, group.depth[j]), depth));
      if (hn::AllFalse(d, hn::Gt(hidden, hn::Zero(d)))) continue;
      auto const other =
          hn::Add(hn::Mul(hn::Set(d, how.reliability_ratio), hn::Load(d, group.rank[j])), hn::Set(d, 1e-30F));
      auto const low = Clamp(hn::Sub(hn::Set(d, 2.0F), hn::Mul(hn::Set(d, 2.0F), hn::Div(rank, other))), 0.0F, 1.0F);
      auto const there = hn::Gt(hn::Load(d, group.rank[j]), hn::Zero(d));
      doubt = hn::Max(doubt, hn::IfThenElseZero(there, hn::Mul(hidden, low)));
    }
    hn::Store(hn::IfThenElseZero(hn::Gt(rank, hn::Zero(d)), hn::Sub(one, doubt)), d, group.reliable[i]);
  }
  for (std::size_t k = 0; k < group.count; ++k) {
    auto const depth = hn::Load(d, group.depth[k]);
    auto hidden = hn::Zero(d);
    for (std::size_t i = 0; i < group.count; ++i) {
      auto const behind = hide(hn::Sub(depth, hn::Load(d, group.depth[i])));
      hidden = hn::Max(hidden, hn::Mul(hn::Load(d, group.reliable[i]), behind));
    }
    hn::Store(hn::Mul(hn::Load(d, group.reliable[k]), hn::Sub(one, hidden)), d, group.seen[k]);
  }
}

/// Shares in the colour: of the views with weight, and as far as these are not good enough, of those that fill.
HWY_INLINE void SoftZShares(ComposedLayer const* layers, Composition const& how, Group& group) {
  Floats const d;
  auto const one = hn::Set(d, 1.0F);
  SoftZSeen(how, group);
  auto good = hn::Zero(d);
  for (std::size_t k = 0; k < group.count; ++k) {
    float const weight = layers[group.layer[k]].weight;
    if (!(weight > 0)) continue;
    auto const quality = hn::Load(d, group.quality[k]);
    auto const goodness =
        hn::Min(one, hn::Add(hn::Set(d, how.good_at_zero), hn::Mul(quality, hn::Set(d, 1.0F / how.good_quality))));
    auto const there = hn::Gt(quality, hn::Zero(d));
    auto const part = hn::Mul(hn::Mul(hn::Set(d, weight), goodness), hn::Load(d, group.seen[k]));
    good = hn::Add(good, hn::IfThenElseZero(there, part));
  }
  auto const need = Clamp(hn::Sub(one, hn::Mul(good, hn::Set(d, 1.0F / how.good_enough))), how.always, 1.0F);
  for (std::size_t k = 0; k < group.count; ++k) {
    auto const weight =
        hn::Add(hn::Set(d, layers[group.layer[k]].weight), hn::Mul(need, hn::Load(d, group.fair_fill[k])));
    auto quality = hn::Load(d, group.quality[k]);
    for (int i = 0; i < how.squarings; ++i) quality = hn::Mul(quality, quality);
    hn::Store(hn::Mul(hn::Mul(weight, quality), hn::Load(d, group.seen[k])), d, group.share[k]);
  }
}

HWY_INLINE void NearestShares(Group& group) {
  Floats const d;
  for (std::size_t k = 0; k < group.count; ++k) {
    auto const depth = hn::Load(d, group.depth[k]);
    auto wins = hn::Gt(hn::Load(d, group.rank[k]), hn::Zero(d));
    for (std::size_t i = 0; i < group.count; ++i) {
      if (i == k) continue;
      auto const other = hn::Load(d, group.depth[i]);
      auto const before = i < k ? hn::Le(other, depth) : hn::Lt(other, depth);
      wins = hn::AndNot(hn::And(before, hn::Gt(hn::Load(d, group.rank[i]), hn::Zero(d))), wins);
    }
    hn::Store(hn::IfThenElseZero(wins, hn::Set(d, 1.0F)), d, group.share[k]);
  }
}

/// Of the shares only the greatest (the first of equals).
HWY_INLINE void OnlyWinner(Group& group) {
  Floats const d;
  auto greatest = hn::Zero(d);
  for (std::size_t k = 0; k < group.count; ++k) greatest = hn::Max(greatest, hn::Load(d, group.share[k]));
  auto found = hn::FirstN(d, 0);
  for (std::size_t k = 0; k < group.count; ++k) {
    auto const share = hn::Load(d, group.share[k]);
    auto const wins = hn::AndNot(found, hn::Eq(share, greatest));
    hn::Store(hn::IfThenElseZero(wins, share), d, group.share[k]);
    found = hn::Or(found, wins);
  }
}

HWY_INLINE hn::Vec<Words> Encode(V linear) {
  Floats const d;
  Ints const di;
  Words const du;
  auto const root = hn::Mul(hn::Sqrt(Clamp(linear, 0.0F, 1.0F)), hn::Set(d, static_cast<float>(kEncodeSteps)));
  return hn::GatherIndex(du, encode_table().data(), hn::ConvertTo(di, hn::Add(root, hn::Set(d, 0.5F))));
}

void ComposeLayers(ComposedLayer const* layers, std::size_t count, Composition const& how, TileArea const& area,
                   std::uint32_t* color, std::size_t color_stride, float* depth, std::size_t depth_stride,
                   std::size_t* indices, float* scratch) {
  Floats const d;
  Words const du;
  std::size_t const lanes = hn::Lanes(d);
  Group group(count, indices, scratch);
  HWY_ALIGN std::uint32_t last_colors[kMostLanes];
  HWY_ALIGN float last_depths[kMostLanes];
  std::size_t const columns = static_cast<std::size_t>(area.right - area.left);
  for (std::size_t y = 0; y < static_cast<std::size_t>(area.bottom - area.top); ++y) {
    for (std::size_t x = 0; x < columns; x += lanes) {
      std::size_t const at = y * kTileStride + x;
      GatherGroup(layers, count, how, at, group);
      auto bgra = hn::Zero(du);
      auto z = hn::Set(d, std::numeric_limits<float>::quiet_NaN());
      if (group.count > 0) {
        if (how.nearest) {
          NearestShares(group);
        } else {
          SoftZShares(layers, how, group);
        }
        if (how.winner || how.show == 2) OnlyWinner(group);
        Color sum{hn::Zero(d), hn::Zero(d), hn::Zero(d)};
        auto total = hn::Zero(d), sum_z = hn::Zero(d);
        for (std::size_t k = 0; k < group.count; ++k) {
          auto const share = hn::Load(d, group.share[k]);
          sum_z = hn::Add(sum_z, hn::Mul(share, hn::Load(d, group.depth[k])));
          total = hn::Add(total, share);
        }
        auto const any = hn::Gt(total, hn::Zero(d));
        auto const inverse = hn::Div(hn::Set(d, 1.0F), hn::IfThenElse(any, total, hn::Set(d, 1.0F)));
        auto const mean_z = hn::Mul(sum_z, inverse);
        auto const px = hn::Add(hn::Iota(d, 0), hn::Set(d, static_cast<float>(area.left) + static_cast<float>(x)));
        float const py = static_cast<float>(area.top) + static_cast<float>(y);
        for (std::size_t k = 0; k < group.count; ++k) {
          auto const share = hn::Load(d, group.share[k]);
          auto const counts = hn::Gt(share, hn::Zero(d));
          if (hn::AllFalse(d, counts)) continue;
          ComposedLayer const& layer = layers[group.layer[k]];
          auto s = hn::LoadU(d, layer.samples.s + at), t = hn::LoadU(d, layer.samples.t + at);
          // By pixel, so that what is drawn does not depend on the vector's width.
          auto const mixed = hn::Gt(total, share);
          if (how.agree && !hn::AllFalse(d, mixed)) {
            auto const row = [&](int r) HWY_ATTR {
              auto const linear = [&](float const* m) HWY_ATTR {
                return hn::Add(hn::Mul(hn::Set(d, m[0]), px), hn::Set(d, m[1] * py + m[2]));
              };
              return hn::Add(hn::Mul(mean_z, linear(layer.along[r])), linear(layer.at[r]));
            };
            auto const inverse_w = hn::Div(hn::Set(d, 1.0F), row(2));
            s = hn::IfThenElse(mixed, hn::Mul(row(0), inverse_w), s);
            t = hn::IfThenElse(mixed, hn::Mul(row(1), inverse_w), t);
          }
          Color const c = how.show == 0
                              ? SampleLayer(layer, at, counts, s, t)
                              : Color{hn::Set(d, layer.hue[0]), hn::Set(d, layer.hue[1]), hn::Set(d, layer.hue[2])};
          sum.r = hn::Add(sum.r, hn::Mul(share, c.r));
          sum.g = hn::Add(sum.g, hn::Mul(share, c.g));
          sum.b = hn::Add(sum.b, hn::Mul(share, c.b));
        }
        auto const r = Encode(hn::Mul(sum.r, inverse)), g = Encode(hn::Mul(sum.g, inverse)),
                   b = Encode(hn::Mul(sum.b, inverse));
        auto const opaque =
            hn::Or(hn::Or(b, hn::ShiftLeft<8>(g)), hn::Or(hn::ShiftLeft<16>(r), hn::Set(du, 0xff000000U)));
        bgra = hn::IfThenElseZero(hn::RebindMask(du, any), opaque);
        z = hn::IfThenElse(any, mean_z, z);
      }
      std::uint32_t* const to = color + y * color_stride + x;
      float* const to_depth = depth + y * depth_stride + x;
      if (x + lanes <= columns) {
        hn::StoreU(bgra, du, to);
        hn::StoreU(z, d, to_depth);
      } else {
        hn::Store(bgra, du, last_colors);
        hn::Store(z, d, last_depths);
        std::copy_n(last_colors, columns - x, to);
        std::copy_n(last_depths, columns - x, to_depth);
      }
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace scanview
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scanview {

HWY_EXPORT(MeasureQuality);
HWY_EXPORT(ComposeLayers);

void measure_quality(ComposedLayer const& layer, Composition const& how, TileArea const& area) {
  HWY_DYNAMIC_DISPATCH(MeasureQuality)(layer, how, area);
}

void compose_layers(ComposedLayer const* layers, std::size_t count, Composition const& how, TileArea const& area,
                    std::uint32_t* color, std::size_t color_stride, float* depth, std::size_t depth_stride) {
  // Seven arrays of a vector of the widest kind.
  constexpr std::size_t kScratchFloats = 7 * 16;
  thread_local std::vector<std::size_t> indices;
  thread_local hwy::AlignedFreeUniquePtr<float[]> scratch;
  if (indices.size() < count) {
    indices.resize(count);
    scratch = hwy::AllocateAligned<float>(kScratchFloats * count);
  }
  HWY_DYNAMIC_DISPATCH(ComposeLayers)
  (layers, count, how, area, color, color_stride, depth, depth_stride, indices.data(), scratch.get());
}

}  // namespace scanview
#endif
