#pragma once
#include <array>
#include <cstddef>
#include <vector>

#include "acquire/scan_set.h"
#include "mesh/surface_links.h"

namespace scanview {

/// A side of a node (captured_node.h) with `pixels` more on each of its edges: what the other sides see there, as this
/// one's camera would have it: 1/z bilinear, or of the nearest pixel where the four are more than half apart; class
/// no_depth where none looks there. Without colours. So that what is decided by pixels beyond the picture's edge, steps
/// and distances to them, is decided as if there were no edge.
RangeImage with_gutter(std::vector<View> const& sides, std::size_t side, int pixels);

/// The part of a picture with a gutter that is the picture.
SurfaceLinks without_gutter(SurfaceLinks const& links, int pixels);

/// SideTriangulation::beyond, of a picture with a gutter and its links.
std::array<std::vector<double>, 4> beyond_edges(RangeImage const& wide, SurfaceLinks const& links, int pixels);

}  // namespace scanview
