#pragma once
#include "base/context.h"
#include "mesh/triangle_mesh.h"

namespace scanview {

/// A plush dog that stands on its four paws, its head turned, one ear hanging and one up: about 120 mm long and tall, y
/// up, looking along +z, the soles at y = 0; in honour of the one in Pulli 1997. Thin parts (ears, tag, its ring), gaps
/// beneath the belly and between the legs, self-occlusion; light and dark coat with detail from 0.5 mm up, patches that
/// are sewn on, stitched seams. Closed, oriented outwards, always the same.
TriangleMesh make_dog(float spacing_mm, Context& context);

}  // namespace scanview
