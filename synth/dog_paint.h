#pragma once
#include <Eigen/Core>

#include "synth/dog_shape.h"

namespace scanview {

/// sRGB colour (paint.h) of a point on the surface of a part of the dog; albedo 0.04 to 0.9.
Eigen::Vector3f paint_dog(Eigen::Vector3f const& p, DogPart part);

}  // namespace scanview
