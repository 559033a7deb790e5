#pragma once
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <vector>

namespace scanview {

/// The middle value (the upper of two); NaN where there is none. No value may be NaN.
inline double median(std::vector<double> values) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// The standard deviation of normal values, little disturbed by some that are not: 1.4826 times the median distance
/// from the median. NaN without values.
inline double robust_deviation(std::vector<double> values) {
  double const center = median(values);
  for (double& value : values) value = std::abs(value - center);
  return 1.4826 * median(std::move(values));
}

}  // namespace scanview
