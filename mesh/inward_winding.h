#pragma once
#include "mesh/triangle_mesh.h"

namespace scanview {

/// Whether the triangles show their backs outwards. Decided by the closed parts where they are at least half of the
/// surface: parts connected by edges (of positions, so that doubled vertices do not matter) along which as many
/// triangles run one way as the other; together they enclose a negative volume. Otherwise by all triangles: the volume
/// between them and their centroid is negative, and by a quarter of what it could be at most, a bound that scanned
/// sheets and other surfaces without an inside stay below. A room that is modelled to be seen from inside counts as
/// wound inwards.
bool is_wound_inwards(TriangleMesh const& mesh);

/// All triangles seen from the other side.
TriangleMesh turned(TriangleMesh mesh);

}  // namespace scanview
