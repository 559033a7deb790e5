#pragma once
#include <memory>
#include <vector>

#include "acquire/scan_set.h"
#include "mesh/view_mesh.h"
#include "viewer/gl/gl_context.h"
#include "viewer/renderer.h"

namespace scanview {

struct ViewBasedOptions {
  /// Soft z: samples within this depth of the nearest reliable one are averaged (units); weights ramp to zero at 1.5
  /// times it. Negative: from the set's error budget.
  double threshold = -1;
  /// A sample whose weight is below this share of one further away does not hide it (Pulli 1997: "a low confidence
  /// pixel in front of a high confidence one is ignored").
  double reliability_ratio = 0.1;
  /// Views beyond the three whose faint weight fills what these do not see; 0: the paper's three only.
  int fill_views = 4;
  /// Views that are not used (held out).
  std::vector<std::size_t> excluded;
  void validate() const;
};

/// The paper's renderer: the views around the eye, blended with w = w_barycentric · w_cos · w_feather under soft
/// z-buffering. Holds what it needs of set and meshes (textures on the GPU); the context must outlive it. A set without
/// poses or with no mesh at all throws Error{bad_input}.
std::unique_ptr<Renderer> make_view_based_renderer(GlContext& context, ScanSet const& set,
                                                   std::vector<ViewMesh> const& meshes,
                                                   ViewBasedOptions const& options = {});

}  // namespace scanview
