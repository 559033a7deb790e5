#pragma once
#include <array>
#include <cmath>

namespace scanview {

/// The sRGB transfer function (IEC 61966-2-1) and its inverse; both map [0, 1] to [0, 1].
inline double linear_from_srgb(double encoded) {
  return encoded <= 0.04045 ? encoded / 12.92 : std::pow((encoded + 0.055) / 1.055, 2.4);
}
inline double srgb_from_linear(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

/// linear_from_srgb of every 8-bit value.
inline std::array<double, 256> const& linear_from_srgb8() {
  static std::array<double, 256> const table = [] {
    std::array<double, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = linear_from_srgb(static_cast<double>(i) / 255);
    return values;
  }();
  return table;
}

}  // namespace scanview
