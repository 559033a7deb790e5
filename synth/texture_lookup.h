#pragma once
#include <Eigen/Core>

#include "mesh/model_textures.h"

namespace scanview {

/// The colour of a texture at (u, v) (TextureCorners), linear R G B: between the centres of the four pixels around it
/// in proportion, in linear light, beyond the edges as the texture goes on. Pixels are not averaged where many of them
/// lie in one of a camera's: its rays sample them.
Eigen::Vector3f texture_color(ModelTexture const& texture, Eigen::Vector2f const& at);

}  // namespace scanview
