#pragma once
#include <Eigen/Core>
#include <vector>

#include "synth/assembly.h"

namespace scanview {

/// The wicker of the flower basket: a bowl of rods that wind over and under its stakes, an open band of crossed rods
/// above, a plaited rim, a foot and a twisted handle with a bow. Lengths in mm, y up, the foot's underside at y = 0.

inline constexpr float kBasketRim = 40;         ///< height of the rim's middle
inline constexpr float kBasketBand = 24.5f;     ///< where the stakes part into the crossed rods of the open band
inline constexpr int kBasketStakes = 24;        ///< the first at angle 0, towards +z
inline constexpr float kBasketHandleTop = 128;  ///< of the handle's middle

/// Radius of the middle of the bowl's wall.
float basket_wall_radius(float y);

std::vector<Solid> basket_weave();

}  // namespace scanview
