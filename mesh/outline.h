#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "mesh/surface_links.h"

namespace scanview {

/// A side between two pixels that are not on one surface, walked along: the pixel to the left (where x × y, the
/// picture's own axes, is positive) and the one to the right. Either may lie outside the picture or have no depth.
struct Gate {
  Eigen::Vector2i left, right;
};

/// A straight piece of an outline. It passes between the two pixels of each of its gates, in order, at least 1/150 of a
/// pixel away from their centres.
struct OutlineSegment {
  int from = 0, to = 0;     ///< vertices
  std::vector<Gate> gates;  ///< those it passes, in order; the ones its ends lie on included
};

/// An end of segments, at a corner of pixels or on a side between two: each coordinate is a multiple of 1/8.
struct OutlineVertex {
  Eigen::Vector2d position;
  std::vector<Eigen::Vector2i> pixels;  ///< the two or four around it that are inside the picture
};

/// The outline of the object and its step edges as polylines that part the picture exactly: of two neighbouring
/// pixels that are not linked, a segment lies between; of two that are, none (but beyond the end of a step edge).
/// Segments meet only at their ends.
struct Outline {
  std::vector<OutlineVertex> vertices;
  std::vector<OutlineSegment> segments;
};

/// Follows the sides of pixels that part what is not on one surface, then simplifies: a segment is as long as it can be
/// while it stays between the pixel centres on either hand (the longest digital straight segments of the border, within
/// half a pixel of it). Linear in the number of pixels but for the restarts of the simplification.
Outline trace_outline(SurfaceLinks const& links);

}  // namespace scanview
