#pragma once
#include <Eigen/Core>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"

namespace scanview {

struct ExposureOptions {
  /// Two depths of one surface may differ by so much, units. Negative: from the set's error budget, and where that
  /// knows nothing 1 % of the set's radius.
  double threshold = -1;
  /// How far from 1 a gain may go, either way.
  double greatest_gain = 2;
  void validate() const;
};

/// Gains (R, G, B in linear light; View::gain) that bring the views to one exposure: what automatic exposure and white
/// balance changed between the shots would otherwise be seen as seams. For each pair of views the colours of the
/// surface that both see are compared (sums over pixels that are neither dark nor saturated), and the logarithms of all
/// gains solved by least squares, weighted by the numbers of pixels, with a prior that counts like a hundredth of a
/// view's pixels. Their mean logarithm is 0 in every part of the set that hangs together; a view that overlaps with
/// none keeps 1. Needs poses. Pairs² · pixels / 16.
std::vector<Eigen::Vector3d> estimate_gains(ScanSet const& set, ExposureOptions const& options, Context& context);

}  // namespace scanview
