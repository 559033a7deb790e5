#pragma once
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "register/alignment.h"

namespace scanview {

inline constexpr double kDegree = std::numbers::pi / 180;

/// Whatever the input, no pose and no figure is NaN or infinite.
inline void expect_finite(Alignment const& got) {
  for (Eigen::Isometry3d const& pose : got.object_from_camera) EXPECT_TRUE(pose.matrix().allFinite());
  for (PoseFigures const& pose : got.poses)
    EXPECT_TRUE(std::isfinite(pose.std_deg) && std::isfinite(pose.std_length))
        << pose.std_deg << " " << pose.std_length;
  for (PairFigures const& pair : got.pairs)
    EXPECT_TRUE(std::isfinite(pair.rms) && std::isfinite(pair.median_distance) && std::isfinite(pair.overlap));
}

}  // namespace scanview
