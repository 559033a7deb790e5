#pragma once
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "base/html.h"
#include "register/alignment.h"
#include "register/alignment_figures.h"
#include "register/observers.h"

namespace scanview {

/// What report and figures tell of an alignment beyond its own numbers.
struct AlignmentReview {
  std::vector<PairDistances> before, after;  ///< a pair of the alignment each, at the initial and at the final poses
  std::vector<double> seen;                  ///< a view: share of its depths that another view sees
  std::vector<Observers> observers;          ///< of the views that others see least, 24 at most, in the set's order
  double radius = 0;                         ///< of the largest view, units
};

/// `before` are the initial poses, a view each. Cost: pairs times samples, and views squared times the pixels looked
/// at, which become fewer as views become many.
AlignmentReview review_alignment(ScanSet const& set, std::vector<Eigen::Isometry3d> const& before,
                                 Alignment const& alignment, Context& context);

/// The pair of largest median distance; null where no views overlap.
PairFigures const* worst_pair(Alignment const& alignment);

/// In words how it ended and the worst pair; cross-sections before and after, the overlap graph, residuals a pair, how
/// many views see each part of the surface, figures of pairs and poses.
ReportSection register_section(ScanSet const& set, std::vector<Eigen::Isometry3d> const& before,
                               Alignment const& alignment, AlignmentReview const& review);

}  // namespace scanview
