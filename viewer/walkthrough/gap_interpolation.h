#pragma once
#include "viewer/renderer.h"

namespace scanview {

/// Gives pixels where nothing was drawn (alpha 0) colours and depths of what lies around them, from coarse to fine (a
/// pyramid of means, filled from the top: Burt 1988, Gortler and others 1996). Where near and far meet at a gap it is
/// the far that goes on behind the near, so of every four pixels only those count that are at least half as far away as
/// the farthest. Pixels that were drawn stay as they are; a frame in which nothing was drawn stays empty. Linear in the
/// pixels.
void interpolate_gaps(Frame& frame);

}  // namespace scanview
