#include "synth/linear_color.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>

#include "base/error.h"
#include "base/srgb.h"

namespace scanview {

Eigen::Vector3f linear_from_hex(std::string const& hex) {
  unsigned value = 0;
  char const* const end = hex.data() + hex.size();
  bool good = hex.size() == 7 && hex[0] == '#';
  if (good) {
    auto const parsed = std::from_chars(hex.data() + 1, end, value, 16);
    good = parsed.ec == std::errc() && parsed.ptr == end;
  }
  if (!good) throw Error(ErrorCode::usage, {}, fmt::format("colour '{}': expected #rrggbb", hex));
  auto const channel = [&](int shift) { return static_cast<float>(linear_from_srgb8()[value >> shift & 0xff]); };
  return {channel(16), channel(8), channel(0)};
}

Eigen::Vector3f linear_from_bgr(cv::Vec3b const& bgr) {
  static std::array<float, 256> const linear = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = static_cast<float>(linear_from_srgb8()[i]);
    return table;
  }();
  return {linear[bgr[2]], linear[bgr[1]], linear[bgr[0]]};
}

cv::Vec3d bgr_from_linear(Eigen::Vector3f const& linear) {
  cv::Vec3d bgr;
  for (int c = 0; c < 3; ++c) bgr[c] = 255.0 * srgb_from_linear(std::clamp(linear[2 - c], 0.0f, 1.0f));
  return bgr;
}

}  // namespace scanview
