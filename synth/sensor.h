#pragma once
#include <cstdint>
#include <opencv2/core/mat.hpp>

#include "base/random.h"
#include "synth/capture_options.h"

namespace scanview {

/// From light to pixel values. Light 1 fills the sensor.
class Sensor {
 public:
  explicit Sensor(SensorOptions const& options);

  /// CV_8U or CV_16U.
  int type() const { return options_.bits == 16 ? CV_16U : CV_8U; }
  double largest() const { return options_.bits == 16 ? 65535 : 255; }
  /// Values of `count` pixels from their light, with noise; `values` has type(). Numbers of `random` are used up.
  void expose(float const* light, int count, CounterRandom random, void* values) const;
  /// The mean of a pixel's value before rounding, without noise: what a decoder should see.
  double value(double light) const;

 private:
  template <class T>
  void expose_as(float const* light, int count, CounterRandom& random, T* values) const;
  SensorOptions options_;
};

}  // namespace scanview
