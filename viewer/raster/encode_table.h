#pragma once
#include <array>
#include <cmath>
#include <cstdint>

#include "base/srgb.h"

namespace scanview {

inline constexpr int kEncodeSteps = 2047;

/// The 8-bit sRGB value of linear light x at place √x · kEncodeSteps: nine or more entries to a value.
inline std::array<std::uint32_t, kEncodeSteps + 1> const& encode_table() {
  static auto const table = [] {
    std::array<std::uint32_t, kEncodeSteps + 1> values{};
    for (std::size_t i = 0; i < values.size(); ++i) {
      double const root = static_cast<double>(i) / kEncodeSteps;
      values[i] = static_cast<std::uint32_t>(std::lround(255 * srgb_from_linear(root * root)));
    }
    return values;
  }();
  return table;
}

}  // namespace scanview
