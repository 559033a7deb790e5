#pragma once
#include "base/context.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// A round wicker basket full of flowers, 131 mm tall to the top of its handle, y up, its foot at y = 0; in honour of
/// the one in Pulli 1997. Rods woven over and under, an open lattice below the rim, thin petals and leaves that stand
/// free, hollow cups, much self-occlusion. Closed, oriented outwards, always the same.
TriangleMesh make_basket(float spacing_mm, Context& context);

}  // namespace scanview
