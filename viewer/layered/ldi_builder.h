#pragma once
#include <memory>
#include <unordered_map>
#include <vector>

#include "base/context.h"
#include "viewer/layered/ldi_sums.h"
#include "viewer/layered/ldi_tree.h"
#include "viewer/layered/stamp.h"

namespace scanview {

/// Cells by their place.
using LdiSumCells = std::unordered_map<LdiCellKey, std::unique_ptr<LdiSums>, LdiCellKeyHash>;

/// Splats reference images into cells (Chang 1998, §3.1). A tree made of them does not depend on the order in which
/// they were added, nor on the number of threads: all that is kept are sums of integers.
///
/// A pixel goes to the level with the greatest step P ≤ coarseness · S and there to all grid points that are within its
/// stamp: weights are those of equations 3a and 3b, on the parallelogram that the stamp is, seen from the face's axis;
/// so neighbouring pixels' weights add up to 1 everywhere. On the way its depth follows the tangent plane.
///
/// Some million pixels a second and core; memory: 48 bytes for each pixel of the levels that images went to.
class LdiBuilder {
 public:
  explicit LdiBuilder(LdiOptions const& options);

  /// Views must have poses and images; throws Error{bad_input} that names the view otherwise, or where more was
  /// splatted to one place than sums can hold, or pixels are farther from the origin than 2^44 of their size.
  void add(std::vector<View> const& views, Context& context);
  /// All that has been added, filtered upwards. Throws Error{bad_input} where no pixel had a depth, or all of
  /// them together cover nothing (far smaller than the smallest feature).
  LdiTree build(Unit unit, Context& context) const;

  LdiOptions const& options() const { return options_; }
  LdiSumCells const& sums() const { return cells_; }
  /// Goes on from a tree whose sums were kept (ldi_file.h).
  void resume(LdiTree const& tree, LdiSumCells&& sums);

 private:
  struct Landing;
  void add_batch(std::vector<View> const& views, std::size_t begin, std::size_t end, Context& context);
  void land(Stamp const& stamp, std::vector<Landing>& landings) const;

  LdiOptions options_;
  LdiSumCells cells_;
  std::vector<View> views_;
  std::uint64_t input_pixels_ = 0, input_bytes_ = 0;
};

}  // namespace scanview
