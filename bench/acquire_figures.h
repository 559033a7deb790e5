#pragma once
#include <cmath>
#include <cstddef>

#include "acquire/acquire.h"
#include "bench/acquire_truth.h"

namespace scanview {

/// Mean of squares that grows.
struct MeanSquare {
  double sum = 0;
  std::size_t count = 0;
  void add(double value) { sum += value * value, ++count; }
  double rms() const { return count > 0 ? std::sqrt(sum / static_cast<double>(count)) : std::nan(""); }
};

/// How one decoder's depths compare with the truth, over all views. "Right" is within five sigma.
struct DepthFigures {
  std::size_t visible = 0, covered = 0;  ///< true pixels seen by both cameras and lit; of them those with a depth
  std::size_t depths = 0, right = 0;     ///< depths where the truth has one
  std::size_t within_2_2 = 0;            ///< of the right ones: sigmas
  MeanSquare error, ratio;               ///< of the right ones: error, error / sigma
  MeanSquare even_error, even_bound, even_ratio;  ///< away from steps: error, bound, error / bound
  MeanSquare plain_error, plain_bound;            ///< and away from edges of reflectance, too

  void add(RangeImage const& image, TrueView const& truth);
  Json to_json() const;
};

/// Errors of two decoders within kAround pixels of an edge, where both give a depth.
struct EdgeFigures {
  MeanSquare space_time, stripe;              ///< all such pixels
  MeanSquare space_time_right, stripe_right;  ///< where both are within five of their own sigmas

  void add(RangeImage const& space_time, RangeImage const& stripe, TrueView const& truth);
  Json to_json() const;
};

/// The space-time decoder's codes before they are resampled, one pixel each, over their bound.
struct CodeFigures {
  MeanSquare from_light;   ///< error from the middle of the pixel's own light, over the bound: noise alone
  MeanSquare from_center;  ///< error from the code at the pixel's centre, over the bound: with paint and curvature

  void add(CodeImage const& image, TrueView const& truth, CaptureSide side);
  Json to_json() const;
};

}  // namespace scanview
