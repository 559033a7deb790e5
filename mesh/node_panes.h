#pragma once
#include "mesh/node_mesh.h"

namespace scanview {

/// Gives a node its panes (NodeMesh::panes): the triangles of its sky again, but no farther away than what frames them,
/// as if the sky were painted on the glass of a window. What frames them are the other vertices in the directions of
/// the sky's outline; between, 1 / d is as smooth as the triangles allow (the mean of its neighbours at every vertex).
/// Sky that nothing frames has none. `sky_depth`: vertices at least half as far away are of the sky.
void add_panes(NodeMesh& node, double sky_depth);

}  // namespace scanview
