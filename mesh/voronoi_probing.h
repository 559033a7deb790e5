#pragma once
#include "base/context.h"
#include "mesh/depth_field.h"
#include "mesh/depth_triangulation.h"
#include "mesh/greedy_insertion.h"

namespace scanview {

/// Refines a triangulation by probing Voronoi edges (Darsa, Costa, Varshney 1998, §4.2). Two vertices that share an
/// edge are neighbours in the Voronoi diagram; their Voronoi edge runs between the centres of the circles around the
/// two triangles. Its priority is the product of what the paper names: the difference in depth between the two samples,
/// relative to the nearer; the size of their cells (their distance squared); and their nearness to the eye. The first
/// of the queue is probed at a random place of its Voronoi edge (of `context.seed`), where a vertex with that pixel's
/// depth is put: depths are only asked for there. An edge whose triangles both keep `limit` tolerances is not probed;
/// `measure`, the field, is looked at for that alone. Ends where all keep it or the next vertex would make more than
/// `max_triangles` (0: no limit); what random places don't settle is finished by insert_greedily().
void probe_voronoi_edges(DepthTriangulation& triangulation, DepthField const& measure, VertexMaker const& maker,
                         double limit, int max_triangles, Context& context);

}  // namespace scanview
