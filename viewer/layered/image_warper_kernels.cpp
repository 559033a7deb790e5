#include "viewer/layered/image_warper_kernels.h"

#include <bit>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/layered/image_warper_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace scanview {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;
using V = hn::Vec<Floats>;
constexpr std::size_t kMostLanes = 16;

/// A row of m for one row of the picture: M q = slope x + rest.
struct RowForm {
  float slope, rest, b;
};

template <bool kFromPerspective>
HWY_INLINE V Transform(RowForm const& form, V x, V depth) {
  Floats const d;
  auto const mq = hn::Add(hn::Mul(hn::Set(d, form.slope), x), hn::Set(d, form.rest));
  auto const b = hn::Set(d, form.b);
  if constexpr (kFromPerspective) return hn::Add(hn::Mul(depth, mq), b);
  return hn::Add(mq, hn::Mul(b, depth));
}

/// Pixels first .. end - 1 of one axis: those whose centres lie within `half` of the stamp's. `some`: there are any in
/// the frame.
struct Span {
  hn::Vec<Ints> first, end;
  hn::Mask<Floats> some;
};

HWY_INLINE Span Covered(V center, V half, float size) {
  Floats const d;
  Ints const di;
  auto const first = hn::Ceil(hn::Sub(center, half));
  // Rounding may lose the only pixel of the smallest stamp.
  auto const end = hn::Max(hn::Ceil(hn::Add(center, half)), hn::Add(first, hn::Set(d, 1.0F)));
  auto const zero = hn::Zero(d), most = hn::Set(d, size);
  auto const some = hn::And(hn::Lt(first, most), hn::Gt(end, zero));
  return {hn::ConvertTo(di, hn::Min(hn::Max(first, zero), most)), hn::ConvertTo(di, hn::Min(hn::Max(end, zero), most)),
          some};
}

/// Stamps of several points, as they are to be drawn.
struct Stamps {
  alignas(64) float depth[kMostLanes];
  alignas(64) std::int32_t at[kMostLanes];  ///< the first pixel
  alignas(64) std::int32_t columns[kMostLanes];
  alignas(64) std::int32_t rows[kMostLanes];
};

HWY_INLINE void Draw(Stamps const& stamps, std::uint32_t bits, std::uint32_t index, WarpTarget const& target) {
  for (; bits != 0; bits &= bits - 1) {
    auto const k = static_cast<std::uint32_t>(std::countr_zero(bits));
    float const depth = stamps.depth[k];
    std::size_t at = static_cast<std::size_t>(stamps.at[k]);
    for (std::int32_t y = stamps.rows[k]; y > 0; --y, at += static_cast<std::size_t>(target.width)) {
      for (std::size_t i = at; i < at + static_cast<std::size_t>(stamps.columns[k]); ++i) {
        if (!(depth < target.depth[i])) continue;
        target.depth[i] = depth;
        target.index[i] = index + k;
      }
    }
  }
}

template <bool kFromPerspective, bool kToPerspective>
HWY_INLINE void Warp(ImageWarp const& warp, WarpRow const& row, float const* depths, WarpTarget const& target) {
  Floats const d;
  Ints const di;
  std::size_t const lanes = hn::Lanes(d);
  RowForm forms[3];
  for (int k = 0; k < 3; ++k) {
    double const* const m = warp.m[k];
    forms[k] = {static_cast<float>(m[0]), static_cast<float>(m[1] * row.y + m[2]), static_cast<float>(m[3])};
  }
  auto const near = hn::Set(d, warp.near), infinite = hn::Set(d, std::numeric_limits<float>::infinity());
  auto const least = hn::Set(d, 0.5F), most = hn::Set(d, kMostHalfStamp);
  auto const one = hn::Set(di, 1);
  auto const width = hn::Set(di, target.width);
  Stamps stamps;
  for (std::size_t i = 0; i < static_cast<std::size_t>(row.count); i += lanes) {
    std::size_t const left = static_cast<std::size_t>(row.count) - i;
    auto const depth = hn::LoadU(d, depths + row.begin + i);
    auto const x = hn::Iota(d, static_cast<float>(row.x + static_cast<std::int32_t>(i)));
    auto const z = Transform<kFromPerspective>(forms[2], x, depth);
    auto u = Transform<kFromPerspective>(forms[0], x, depth), v = Transform<kFromPerspective>(forms[1], x, depth);
    auto half_x = hn::Set(d, warp.half_x), half_y = hn::Set(d, warp.half_y);
    auto scale = hn::Set(d, 1.0F);
    if constexpr (kToPerspective) {
      scale = hn::Div(scale, z);
      u = hn::Mul(u, scale), v = hn::Mul(v, scale);
    }
    if constexpr (kFromPerspective) scale = hn::Mul(scale, depth);
    half_x = hn::Min(hn::Max(hn::Mul(half_x, scale), least), most);
    half_y = hn::Min(hn::Max(hn::Mul(half_y, scale), least), most);
    Span const across = Covered(u, half_x, static_cast<float>(target.width));
    Span const down = Covered(v, half_y, static_cast<float>(target.height));
    auto drawn = hn::And(hn::And(across.some, down.some), hn::And(hn::Gt(z, near), hn::Lt(z, infinite)));
    if (left < lanes) drawn = hn::And(drawn, hn::FirstN(d, left));
    if (hn::AllFalse(d, drawn)) continue;
    auto const columns = hn::Sub(across.end, across.first), rows = hn::Sub(down.end, down.first);
    auto const at = hn::Add(hn::Mul(down.first, width), across.first);
    // Most points are hidden. Whether they are is asked of all lanes at once, at the corners: all there is of 2 by 2.
    auto const inside = hn::RebindMask(di, drawn);
    auto const first = hn::IfThenElseZero(inside, at);
    auto behind = hn::GatherIndex(d, target.depth, first);
    auto const right = hn::IfThenElseZero(inside, hn::Sub(columns, one));
    auto const below = hn::IfThenElseZero(inside, hn::Sub(rows, one));
    auto const more = hn::Or(right, below);
    if (!hn::AllTrue(di, hn::Eq(more, hn::Zero(di)))) {
      auto const under = hn::Add(first, hn::Mul(below, width));
      auto const other =
          hn::Max(hn::GatherIndex(d, target.depth, under), hn::GatherIndex(d, target.depth, hn::Add(under, right)));
      behind = hn::Max(hn::Max(behind, hn::GatherIndex(d, target.depth, hn::Add(first, right))), other);
      behind = hn::IfThenElse(hn::RebindMask(d, hn::Gt(more, one)), infinite, behind);
    }
    drawn = hn::And(drawn, hn::Lt(z, behind));
    if (hn::AllFalse(d, drawn)) continue;
    hn::Store(z, d, stamps.depth);
    hn::Store(at, di, stamps.at);
    hn::Store(columns, di, stamps.columns);
    hn::Store(rows, di, stamps.rows);
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, drawn, bytes);
    Draw(stamps, std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8, row.begin + static_cast<std::uint32_t>(i),
         target);
  }
}

template <bool kFromPerspective, bool kToPerspective>
HWY_INLINE void WarpAll(ImageWarp const& warp, WarpRow const* rows, std::size_t count, float const* depths,
                        WarpTarget const& target) {
  for (std::size_t i = 0; i < count; ++i) Warp<kFromPerspective, kToPerspective>(warp, rows[i], depths, target);
}

void WarpRows(ImageWarp const& warp, WarpRow const* rows, std::size_t count, float const* depths,
              WarpTarget const& target) {
  if (warp.from_perspective) {
    if (warp.to_perspective) return WarpAll<true, true>(warp, rows, count, depths, target);
    return WarpAll<true, false>(warp, rows, count, depths, target);
  }
  if (warp.to_perspective) return WarpAll<false, true>(warp, rows, count, depths, target);
  return WarpAll<false, false>(warp, rows, count, depths, target);
}

}  // namespace HWY_NAMESPACE
}  // namespace scanview
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scanview {

HWY_EXPORT(WarpRows);

void warp_rows(ImageWarp const& warp, WarpRow const* rows, std::size_t count, float const* depths,
               WarpTarget const& target) {
  HWY_DYNAMIC_DISPATCH(WarpRows)(warp, rows, count, depths, target);
}

}  // namespace scanview
#endif
