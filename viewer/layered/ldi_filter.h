#pragma once
#include "base/context.h"
#include "viewer/layered/ldi_builder.h"

namespace scanview {

/// The tree of what was splatted to its cells: near depth bins merged into layers, then from the finest level upwards
/// every cell's pixels filtered into its parent. Each step halves the grid by the bilinear kernel of equations 3a, 3b,
/// weights (1 3 3 1) / 8 along each axis, moves depths along tangent planes, and merges again. That is what splatting
/// every pixel to every ancestor comes to (Chang 1998, §3.1), at a third of the cost of one level in place of one for
/// each, with a filter that is smoother.
///
/// Linear in the pixels; the same bytes whatever the number of threads.
LdiTree filter_upwards(LdiSumCells const& sums, LdiOptions const& options, Context& context);

}  // namespace scanview
