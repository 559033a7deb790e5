#pragma once
#include <memory>

#include "viewer/evaluate/contender.h"
#include "viewer/view_based/view_library.h"

namespace scanview {

struct LumigraphOptions {
  int views = 4;             ///< k
  double angle = 1;          ///< α: penalty of a radian between the rays to the eye and to a view
  double resolution = 0.05;  ///< β: penalty of a view whose pixels are twice as large on the surface as the picture's
  double threshold = -1;     ///< of the depth test: ViewBasedOptions::threshold
};

/// Unstructured lumigraph rendering (Buehler, Bosse, McMillan, Gortler, Cohen 2001, §4.3) on the views' meshes: the
/// peer that `evaluate` compares with. All views are drawn; in each pixel the k that are not hidden and have the least
/// penalty p = α · angle + β · max(0, resolution ratio − 1) are mixed with weights (1 − p / p_(k+1)) / p, normalised;
/// p_(k+1) is the penalty of the next one (infinite where there is none). What is hidden is decided by our own test
/// (SoftZ, over w_cos · w_feather): a view counts where less than half of it is hidden.
std::unique_ptr<HeldOutRenderer> make_lumigraph_renderer(std::shared_ptr<ViewLibrary> library,
                                                         LumigraphOptions const& options = {});

}  // namespace scanview
