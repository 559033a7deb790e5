#pragma once
#include <Eigen/Core>

#include "synth/statuette_plan.h"

namespace scanview {

/// sRGB colour (paint.h) of a point on the surface of a part of the statuette.
Eigen::Vector3f paint_statuette(Eigen::Vector3f const& p, StatuettePart part);

}  // namespace scanview
