#pragma once
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

#include "base/context.h"
#include "register/pair_form.h"

namespace scanview {

/// Relative poses that two views may have, as far as these two can tell: those that a search found fitting.
struct PairHypotheses {
  std::size_t a = 0, b = 0;
  std::vector<Eigen::Isometry3d> b_from_a;
};

struct AssemblyOptions {
  double radius = 1;  ///< of the object, units
  double gate = 0;    ///< distance within which surfaces coincide, units
};

/// Views that lie at another pose among all the others as well, as far as anything tells.
struct AmbiguousBlock {
  std::vector<std::size_t> views;
  double turn_deg = 0;  ///< of the other pose against the one taken
};

/// Puts right what single pairs could not know: a shape with symmetries lies on itself in several poses that two views
/// hardly tell apart, but all views together do. Every view, and every side of every cut of the tree that joins the
/// views, is tried at the other poses which some pair proposes, fitted there to all the rest together, and judged by
/// free space and print against all the rest; what fits better stays. `tree`: pairs of views that join one part; other
/// views are left alone. Returns what remains ambiguous. Deterministic.
std::vector<AmbiguousBlock> improve_assembly(std::vector<SurfacePyramid> const& views,
                                             std::vector<PairHypotheses> const& hypotheses,
                                             std::vector<std::pair<std::size_t, std::size_t>> const& tree,
                                             AssemblyOptions const& options,
                                             std::vector<Eigen::Isometry3d>& object_from_camera, Context& context);

}  // namespace scanview
