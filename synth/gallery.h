#pragma once
#include <Eigen/Geometry>
#include <cstddef>

#include "mesh/triangle_mesh.h"

namespace scanview {

inline constexpr std::size_t kGalleryLeast = 20'000, kGalleryMost = 10'000'000;

/// A gallery to walk through: 3 x 2 rooms of 8 m x 8 m, 4 m high, under skylights and joined by doorways, with
/// pictures, columns, spheres on plinths, a rainbow torus, railings and slender poles. y up, metres, the floor at y =
/// 0, x from 0 to 25.6, z from 0 to 17.2. A union of closed solids that face outwards; colours change at hard edges
/// only.
///
/// The triangles are within 10 percent of `polygons`; shapes and the places of the colours' edges do not depend on
/// their number. Throws Error{usage} outside kGalleryLeast .. kGalleryMost. A second for 10 million.
TriangleMesh make_gallery(std::size_t polygons);

/// Where the eyes of somebody who walks through the gallery can be, 1.6 m above the floor: all rooms, with what stands
/// in them and the walls between them.
Eigen::AlignedBox3d gallery_walk_box();

}  // namespace scanview
