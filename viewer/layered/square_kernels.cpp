#include "viewer/layered/square_kernels.h"

#include <bit>
#include <limits>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/layered/square_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace scanview {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;
using Ints = hn::RebindToSigned<Floats>;

/// A square's side in grid steps: a little more, since neighbours are not quite as far away.
constexpr float kSide = 1.1F;
constexpr float kMostHalf = 32;  // pixels: bounds what a square costs

struct Squares {
  alignas(64) float depth[16];
  alignas(64) float u[16], v[16], per_reach[16];
  alignas(64) std::int32_t at[16];  ///< the first pixel
  alignas(64) std::int32_t left[16], top[16];
  alignas(64) std::int32_t columns[16];
  alignas(64) std::int32_t rows[16];
};

HWY_INLINE void DrawThem(Squares const& squares, std::uint32_t bits, std::uint32_t const* colors, float bias,
                         SquareTarget const& target) {
  for (; bits != 0; bits &= bits - 1) {
    auto const k = static_cast<std::size_t>(std::countr_zero(bits));
    // Of squares of one surface that which is best in the pixel's middle wins.
    float const nearest = squares.depth[k], u = squares.u[k], v = squares.v[k], per_reach = squares.per_reach[k];
    int left = squares.left[k], y = squares.top[k];
    SquareSample const sample{colors[k], nearest};
    std::size_t at = static_cast<std::size_t>(squares.at[k]);
    for (std::int32_t rows = squares.rows[k]; rows > 0; --rows, ++y, at += static_cast<std::size_t>(target.width)) {
      float const dy = (float(y) - v) * per_reach;
      float const of_row = nearest + bias * dy * dy;
      for (std::int32_t c = 0; c < squares.columns[k]; ++c) {
        std::size_t const i = at + static_cast<std::size_t>(c);
        float const dx = (float(left + c) - u) * per_reach;
        float const depth = of_row + bias * dx * dx;
        if (depth > target.depth[i] || (depth == target.depth[i] && !(sample < target.samples[i]))) continue;
        target.depth[i] = depth;
        target.samples[i] = sample;
      }
    }
  }
}

void DrawSquares(LdiPixels const& pixels, std::size_t first, std::size_t count, SquareTransform const& t,
                 SquareTarget const& target) {
  Floats const d;
  Ints const di;
  hn::Rebind<std::uint32_t, Floats> const du;
  hn::Rebind<std::uint8_t, Floats> const du8;
  hn::Rebind<std::int8_t, Floats> const di8;
  hn::Rebind<std::uint16_t, Floats> const du16;
  std::size_t const lanes = hn::Lanes(d);
  auto const zero = hn::Zero(d), one = hn::Set(d, 1.0F), half = hn::Set(d, 0.5F);
  auto const infinite = hn::Set(d, std::numeric_limits<float>::infinity());
  auto const width = hn::Set(di, target.width), single = hn::Set(di, 1);
  auto const columns_of_all = hn::Set(d, float(target.width)), rows_of_all = hn::Set(d, float(target.height));
  auto const m = [&](int row, int column) HWY_ATTR { return hn::Set(d, t.rows[row][column]); };
  Squares squares;
  for (std::size_t k = 0; k < count; k += lanes) {
    std::size_t const i = first + k;
    auto const x = hn::Add(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(du8, pixels.x + i))), half);
    auto const y = hn::Add(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(du8, pixels.y + i))), half);
    auto const z =
        hn::Mul(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(du16, pixels.depth + i))), hn::Set(d, t.depth_scale));
    auto const place = [&](int row) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(m(row, 0), x), hn::Mul(m(row, 1), y)), hn::Add(hn::Mul(m(row, 2), z), m(row, 3)));
    };
    auto const depth = place(2);
    auto u = place(0), v = place(1), per_z = one;
    auto drawn = hn::Lt(depth, infinite);
    if (count - k < lanes) drawn = hn::And(drawn, hn::FirstN(d, count - k));
    // Of coverages from a half on the highest bit is set, which as a sign is negative.
    auto const color = hn::BitCast(di, hn::LoadU(du, pixels.color + i));
    drawn = hn::And(drawn, hn::RebindMask(d, hn::Lt(color, hn::Zero(di))));
    if (t.perspective) {
      drawn = hn::And(drawn, hn::Gt(depth, hn::Set(d, t.near)));
      per_z = hn::Div(one, depth);
      u = hn::Mul(u, per_z), v = hn::Mul(v, per_z);
    }
    auto reach_u = hn::Mul(hn::Set(d, t.half), per_z), reach_v = reach_u;
    if (t.facing != 0) {
      auto const slope = [&](std::int8_t const* from) HWY_ATTR {
        return hn::Mul(hn::ConvertTo(d, hn::PromoteTo(di, hn::LoadU(di8, from + i))),
                       hn::Set(d, 1.0F / float(kLdiSlope)));
      };
      auto const slope_x = slope(pixels.slope_x), slope_y = slope(pixels.slope_y);
      // Half of the box around the grid's cell, as it lies on the tangent plane and on the screen.
      auto const reach = [&](int row, decltype(x) at) HWY_ATTR {
        auto const side = [&](int column, decltype(x) along) HWY_ATTR {
          auto const moved = hn::Add(m(row, column), hn::Mul(along, m(row, 2)));
          if (!t.perspective) return hn::Abs(moved);
          auto const deeper = hn::Add(m(2, column), hn::Mul(along, m(2, 2)));
          return hn::Abs(hn::Mul(hn::Sub(moved, hn::Mul(at, deeper)), per_z));
        };
        return hn::Mul(hn::Set(d, 0.5F * kSide), hn::Add(side(0, slope_x), side(1, slope_y)));
      };
      reach_u = reach(0, u), reach_v = reach(1, v);
      // The normal is (−slope_x, −slope_y, 1), and is to look back along the ray.
      auto const away = [&](decltype(x) at, int axis) HWY_ATTR {
        return t.eye[3] != 0 ? hn::Sub(at, hn::Set(d, t.eye[axis])) : hn::Set(d, t.eye[axis]);
      };
      auto const along = hn::Sub(away(z, 2), hn::Add(hn::Mul(slope_x, away(x, 0)), hn::Mul(slope_y, away(y, 1))));
      drawn = hn::And(drawn, hn::Lt(hn::Mul(along, hn::Set(d, t.facing)), zero));
    }
    reach_u = hn::Min(hn::Max(reach_u, half), hn::Set(d, kMostHalf));
    reach_v = hn::Min(hn::Max(reach_v, half), hn::Set(d, kMostHalf));
    auto const first_u = hn::Ceil(hn::Sub(u, reach_u)), first_v = hn::Ceil(hn::Sub(v, reach_v));
    // Rounding may lose the only pixel of the smallest square.
    auto const end_u = hn::Max(hn::Ceil(hn::Add(u, reach_u)), hn::Add(first_u, one));
    auto const end_v = hn::Max(hn::Ceil(hn::Add(v, reach_v)), hn::Add(first_v, one));
    drawn = hn::And(drawn, hn::And(hn::Lt(first_u, columns_of_all), hn::Gt(end_u, zero)));
    drawn = hn::And(drawn, hn::And(hn::Lt(first_v, rows_of_all), hn::Gt(end_v, zero)));
    if (hn::AllFalse(d, drawn)) continue;
    auto const within = [&](decltype(u) at, decltype(u) most)
                            HWY_ATTR { return hn::ConvertTo(di, hn::Min(hn::Max(at, zero), most)); };
    auto const left = within(first_u, columns_of_all), top = within(first_v, rows_of_all);
    auto const columns = hn::Sub(within(end_u, columns_of_all), left), rows = hn::Sub(within(end_v, rows_of_all), top);
    auto const at = hn::Add(hn::Mul(top, width), left);
    // Whether it is hidden is asked of all lanes at once, at the corners: all there is of 2 by 2.
    auto const inside = hn::RebindMask(di, drawn);
    auto const corner = hn::IfThenElseZero(inside, at);
    auto const right = hn::IfThenElseZero(inside, hn::Sub(columns, single));
    auto const below = hn::IfThenElseZero(inside, hn::Sub(rows, single));
    auto const under = hn::Add(corner, hn::Mul(below, width));
    auto behind = hn::Max(
        hn::Max(hn::GatherIndex(d, target.depth, corner), hn::GatherIndex(d, target.depth, hn::Add(corner, right))),
        hn::Max(hn::GatherIndex(d, target.depth, under), hn::GatherIndex(d, target.depth, hn::Add(under, right))));
    behind = hn::IfThenElse(hn::RebindMask(d, hn::Gt(hn::Or(right, below), single)), infinite, behind);
    drawn = hn::And(drawn, hn::Le(depth, behind));
    if (hn::AllFalse(d, drawn)) continue;
    hn::Store(depth, d, squares.depth);
    hn::Store(at, di, squares.at);
    hn::Store(columns, di, squares.columns);
    hn::Store(u, d, squares.u);
    hn::Store(v, d, squares.v);
    hn::Store(hn::Div(one, hn::Max(reach_u, reach_v)), d, squares.per_reach);
    hn::Store(left, di, squares.left);
    hn::Store(top, di, squares.top);
    hn::Store(rows, di, squares.rows);
    std::uint8_t bytes[8] = {};
    hn::StoreMaskBits(d, drawn, bytes);
    DrawThem(squares, std::uint32_t{bytes[0]} | std::uint32_t{bytes[1]} << 8, pixels.color + i, t.bias, target);
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace scanview
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scanview {

HWY_EXPORT(DrawSquares);

void draw_squares(LdiPixels const& pixels, std::size_t first, std::size_t count, SquareTransform const& transform,
                  SquareTarget const& target) {
  HWY_DYNAMIC_DISPATCH(DrawSquares)(pixels, first, count, transform, target);
}

}  // namespace scanview
#endif
