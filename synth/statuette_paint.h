#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>

#include "synth/statuette_plan.h"

namespace scanview {

/// 8-bit sRGB colour (BGR) of a point on the surface of a part of the statuette.
cv::Vec3b paint_statuette(Eigen::Vector3f const& p, StatuettePart part);

}  // namespace scanview
