#pragma once
#include <cstddef>

#include "mesh/triangle_mesh.h"

namespace scanview {

inline constexpr std::size_t kChurchLeast = 150'000, kChurchMost = 10'000'000;

/// A church after Palladio's Il Redentore, for pictures of its interior: a nave 40 m long, 14 m wide and 16 m high
/// under a coffered barrel vault, aisles behind arcades of columns, an apse behind the altar; with a marble floor,
/// mosaics, windows of pale glass (nothing shines through them), pews, statues, candlesticks. y up, metres, the floor
/// at y = 0, the nave along x from 0 (west) to 40 about z = 0, the apse to x = 46.8.
///
/// The west end is open, as wide and high as nave and aisles: from the west one sees the interior and, of the outside,
/// the ends of walls, vault and floor. There are no other openings. A union of closed solids that face outwards;
/// colours change at hard edges only. Cameras and a path: church_views.h.
///
/// The triangles are within 10 percent of `polygons`; shapes and the places of the colours' edges do not depend on
/// their number, but for how round things are. Throws Error{usage} outside kChurchLeast .. kChurchMost. A second for 10
/// million.
TriangleMesh make_church(std::size_t polygons);

}  // namespace scanview
