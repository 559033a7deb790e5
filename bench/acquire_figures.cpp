#include "bench/acquire_figures.h"

#include <cmath>

namespace scanview {
namespace {

constexpr double kRight = 5, kWithin = 2.2;  // sigmas
constexpr double kRightBounds = 6;           // bounds: a code farther off is another surface's

double share(std::size_t part, std::size_t all) {
  return all > 0 ? static_cast<double>(part) / static_cast<double>(all) : std::nan("");
}

}  // namespace

void DepthFigures::add(RangeImage const& image, TrueView const& truth) {
  for (int y = 0; y < truth.depth.rows; ++y)
    for (int x = 0; x < truth.depth.cols; ++x) {
      if (std::isnan(truth.depth(y, x))) continue;
      bool const has = image.has_depth(x, y);
      if (truth.visible(y, x) != 0) ++visible, covered += has;
      if (!has) continue;
      ++depths;
      double const off = image.depth(y, x) - truth.depth(y, x), sigmas = off / image.sigma(y, x);
      if (!(std::abs(sigmas) <= kRight)) continue;
      ++right;
      within_2_2 += std::abs(sigmas) <= kWithin;
      error.add(off);
      ratio.add(sigmas);
      if (truth.is_even(y, x) == 0) continue;
      even_error.add(off);
      even_bound.add(truth.bound(y, x));
      even_ratio.add(off / truth.bound(y, x));
      if (truth.near_paint(y, x) != 0) continue;
      plain_error.add(off);
      plain_bound.add(truth.bound(y, x));
    }
}

Json DepthFigures::to_json() const {
  return {{"visible", visible},
          {"coverage", json_number(share(covered, visible))},
          {"depths", depths},
          {"wrong", json_number(1 - share(right, depths))},
          {"rms_error", json_number(error.rms())},
          {"rms_error_over_sigma", json_number(ratio.rms())},
          {"within_2_2_sigma", json_number(share(within_2_2, right))},
          {"even_pixels", even_error.count},
          {"even_rms_error", json_number(even_error.rms())},
          {"even_rms_bound", json_number(even_bound.rms())},
          {"rms_error_over_bound", json_number(even_error.rms() / even_bound.rms())},
          {"rms_of_error_over_bound", json_number(even_ratio.rms())},
          {"plain_pixels", plain_error.count},
          {"plain_rms_error_over_bound", json_number(plain_error.rms() / plain_bound.rms())}};
}

void EdgeFigures::add(RangeImage const& a, RangeImage const& b, TrueView const& truth) {
  for (int y = 0; y < truth.depth.rows; ++y)
    for (int x = 0; x < truth.depth.cols; ++x) {
      if (truth.near_edge(y, x) == 0 || std::isnan(truth.depth(y, x))) continue;
      if (!a.has_depth(x, y) || !b.has_depth(x, y)) continue;
      double const off_a = a.depth(y, x) - truth.depth(y, x), off_b = b.depth(y, x) - truth.depth(y, x);
      space_time.add(off_a);
      stripe.add(off_b);
      if (std::abs(off_a) > kRight * a.sigma(y, x) || std::abs(off_b) > kRight * b.sigma(y, x)) continue;
      space_time_right.add(off_a);
      stripe_right.add(off_b);
    }
}

Json EdgeFigures::to_json() const {
  return {{"pixels", space_time.count},
          {"space_time_rms", json_number(space_time.rms())},
          {"stripe_rms", json_number(stripe.rms())},
          {"ratio", json_number(stripe.rms() / space_time.rms())},
          {"right_pixels", space_time_right.count},
          {"right_space_time_rms", json_number(space_time_right.rms())},
          {"right_stripe_rms", json_number(stripe_right.rms())},
          {"right_ratio", json_number(stripe_right.rms() / space_time_right.rms())}};
}

void CodeFigures::add(CodeImage const& image, TrueView const& truth, CaptureSide side) {
  auto const s = static_cast<std::size_t>(side);
  for (int y = 0; y < truth.depth.rows; ++y)
    for (int x = 0; x < truth.depth.cols; ++x) {
      if (truth.is_even(y, x) == 0) continue;
      cv::Vec2i const at = truth.pixel[s](y, x);
      if (at[0] < 0 || at[1] < 0 || at[0] >= image.code.cols || at[1] >= image.code.rows) continue;
      if (!image.has_code(at[0], at[1])) continue;
      double const code = image.code(at[1], at[0]), bound = truth.code_bound[s](y, x);
      double const light = (code - truth.code_light[s](y, x)) / bound;
      double const center = (code - truth.code_center[s](y, x)) / bound;
      if (std::abs(light) <= kRightBounds) from_light.add(light);
      if (std::abs(center) <= kRightBounds) from_center.add(center);
    }
}

Json CodeFigures::to_json() const {
  return {{"pixels", from_light.count},
          {"rms_over_bound", json_number(from_light.rms())},
          {"center_rms_over_bound", json_number(from_center.rms())}};
}

}  // namespace scanview
