#pragma once
#include "base/context.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// A dog that sits on a round plinth between a striped ring and a flower, its head tilted: 91 mm tall, y up, looking
/// along +z, the plinth's underside at y = 0. Thin parts (petals, leaves, stem, ears), holes (ring, tag, between legs
/// and tail), concavities and self-occlusion; colours have detail from 0.5 mm to the size of the object. About
/// 71 000 / spacing_mm² triangles; closed, oriented outwards. Always the same.
TriangleMesh make_statuette(float spacing_mm, Context& context);

}  // namespace scanview
