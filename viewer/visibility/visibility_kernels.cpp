#include "viewer/visibility/visibility_kernels.h"

#include <algorithm>
#include <cmath>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "viewer/visibility/visibility_kernels.cpp"
#include <hwy/foreach_target.h>  // compiles this file once for each instruction set
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace scanview {
namespace HWY_NAMESPACE {
namespace hn = hwy::HWY_NAMESPACE;

using Floats = hn::CappedTag<float, 16>;

void FacingBits(float const* x, float const* y, float const* z, float const* offset, float const* eye,
                std::size_t begin, std::size_t end, std::uint64_t* bits) {
  Floats const d;
  std::size_t const lanes = hn::Lanes(d);
  auto const ex = hn::Set(d, eye[0]), ey = hn::Set(d, eye[1]), ez = hn::Set(d, eye[2]), ew = hn::Set(d, eye[3]);
  auto const margin = hn::Set(d, eye[4]);
  for (std::size_t word = begin / 64; 64 * word < end; ++word) {
    std::uint64_t front = 0;
    for (std::size_t k = 0; k < 64; k += lanes) {
      std::size_t const i = 64 * word + k;
      if (i >= end) break;
      auto const xy = hn::Add(hn::Mul(hn::LoadU(d, x + i), ex), hn::Mul(hn::LoadU(d, y + i), ey));
      auto const z_offset = hn::Sub(hn::Mul(hn::LoadU(d, z + i), ez), hn::Mul(hn::LoadU(d, offset + i), ew));
      std::uint8_t bytes[8] = {};
      hn::StoreMaskBits(d, hn::Gt(hn::Add(xy, z_offset), margin), bytes);
      front |= (std::uint64_t{bytes[0]} | std::uint64_t{bytes[1]} << 8) << k;
    }
    if (64 * word < begin) front &= ~std::uint64_t{0} << (begin % 64);
    if (end < 64 * word + 64) front &= ~(~std::uint64_t{0} << (end % 64));
    bits[word] |= front;
  }
}

/// One row of the result, from those above, at, and below.
template <bool kMiddle>
HWY_INLINE void WindowRow(float const* above, float const* here, float const* below, int width, int step, float* to) {
  Floats const d;
  int const lanes = static_cast<int>(hn::Lanes(d));
  auto const scalar = [&](int x) HWY_ATTR {
    int const left = std::max(x - step, 0), right = std::min(x + step, width - 1);
    float least = std::min(std::min(above[left], above[right]), std::min(below[left], below[right]));
    if (kMiddle) {
      least = std::min(least, std::min(std::min(here[left], here[right]), here[x]));
      least = std::min(least, std::min(above[x], below[x]));
    }
    to[x] = least;
  };
  int x = 0;
  for (; x < std::min(step, width); ++x) scalar(x);
  for (; x + lanes <= width - step; x += lanes) {
    auto const pair = [&](float const* row)
                          HWY_ATTR { return hn::Min(hn::LoadU(d, row + x - step), hn::LoadU(d, row + x + step)); };
    auto least = hn::Min(pair(above), pair(below));
    if (kMiddle) {
      least = hn::Min(least, hn::Min(pair(here), hn::LoadU(d, here + x)));
      least = hn::Min(least, hn::Min(hn::LoadU(d, above + x), hn::LoadU(d, below + x)));
    }
    hn::StoreU(least, d, to + x);
  }
  for (; x < width; ++x) scalar(x);
}

void WindowMinimum(float const* from, PictureSize const& size, int step, bool with_middle, float* to) {
  auto const row = [&](int y) {
    return from +
           static_cast<std::size_t>(std::min(std::max(y, 0), size.height - 1)) * static_cast<std::size_t>(size.stride);
  };
  for (int y = 0; y < size.height; ++y) {
    float* const out = to + static_cast<std::size_t>(y) * static_cast<std::size_t>(size.stride);
    if (with_middle) {
      WindowRow<true>(row(y - step), row(y), row(y + step), size.width, step, out);
    } else {
      WindowRow<false>(row(y - step), row(y), row(y + step), size.width, step, out);
    }
  }
}

}  // namespace HWY_NAMESPACE
}  // namespace scanview
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace scanview {

HWY_EXPORT(FacingBits);
HWY_EXPORT(WindowMinimum);

void facing_bits(FacingPlanes const& planes, float const (&eye)[4], float side, std::size_t begin, std::size_t end,
                 std::uint64_t* bits) {
  float const size = 1 + std::abs(eye[0]) + std::abs(eye[1]) + std::abs(eye[2]);
  // Few roundings of sums no larger than that.
  float const with_margin[5] = {side * eye[0], side * eye[1], side * eye[2], side * eye[3], -4e-7F * size};
  HWY_DYNAMIC_DISPATCH(FacingBits)(planes.x, planes.y, planes.z, planes.offset, with_margin, begin, end, bits);
}

void window_minimum(float const* from, PictureSize const& size, int step, bool with_middle, float* to) {
  HWY_DYNAMIC_DISPATCH(WindowMinimum)(from, size, step, with_middle, to);
}

}  // namespace scanview
#endif
