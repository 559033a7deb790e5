#pragma once
#include <Eigen/Geometry>
#include <vector>

#include "base/context.h"
#include "register/view_surface.h"

namespace scanview {

struct TurntableOptions {
  double step_deg = 0;            ///< 0: a full turn over all views, or back to the first with the last
  Eigen::Vector3d axis{0, 0, 0};  ///< in the first camera's coordinates; zero: fitted
  double radius = 1;              ///< of a view, units
};

/// The object turns in equal steps before a fixed camera: the right-handed rotation by i * step about the axis carries
/// it from its place in the first view to its place in view i.
struct Turntable {
  Eigen::Vector3d axis{0, -1, 0}, point{0, 0, 0};  ///< first camera's coordinates
  double step_deg = 0;
  double cost = 1;  ///< mean truncated overlap cost of neighbours, 0 to 1
  std::vector<Eigen::Isometry3d> object_from_camera(std::size_t views) const;
};

/// Fits the axis by the overlap of neighbouring views and of the last with the first: many starts (tilts of the axis,
/// points behind the surface that is seen, both senses of rotation, full turn over N or N - 1 steps), each improved by
/// Gauss-Newton on point-to-plane distances of projected points; the best few then also by tone, and the step set free
/// by a little. The sense is tried both ways unless both axis and step are given.
Turntable fit_turntable(std::vector<SurfacePyramid> const& views, TurntableOptions const& options, Context& context);

}  // namespace scanview
