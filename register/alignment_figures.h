#pragma once
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "register/alignment.h"
#include "register/view_graph.h"

namespace scanview {

/// Signed distance, point to plane, of a point with a normal (both in the camera coordinates of `to`) from the surface
/// that it meets there. Two views see the same surface where their depths differ by less than `gate` and their normals
/// by less than 70 degrees: else nothing.
std::optional<double> distance_to_surface(ViewSurface const& to, Eigen::Vector3d const& point,
                                          Eigen::Vector3d const& normal, double gate);

/// Distances between the surfaces of two views, all of them: raw depths of either view against the other's surface.
struct PairDistances {
  PairFigures figures;
  std::vector<float> distances;  ///< point to plane, signed, units
};

/// Every edge measured at the poses given, on the finest level. Only what is not the same surface (see above) is left
/// out.
std::vector<PairDistances> measure_pairs(ScanSet const& set, std::vector<SurfacePyramid> const& views,
                                         std::vector<ViewGraphEdge> const& edges,
                                         std::vector<Eigen::Isometry3d> const& object_from_camera, double gate,
                                         Context& context);

/// RMS and 95th percentile over all pairs; NaN where there are no distances.
ErrorPart overall_error(std::vector<PairDistances> const& pairs);

}  // namespace scanview
