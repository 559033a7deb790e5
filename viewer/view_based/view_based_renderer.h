#pragma once
#include <memory>
#include <vector>

#include "acquire/scan_set.h"
#include "mesh/view_mesh.h"
#include "viewer/gl/gl_context.h"
#include "viewer/renderer.h"
#include "viewer/select/view_selection.h"

namespace scanview {

struct ViewBasedOptions {
  /// Soft z: samples within this depth of the nearest reliable one are averaged (units); weights ramp to zero at 1.5
  /// times it. Negative: from the set's error budget, and where that knows nothing 1 % of the set's radius.
  double threshold = -1;
  /// A sample whose weight is below this share of one further away does not hide it (Pulli 1997: "a low confidence
  /// pixel in front of a high confidence one is ignored").
  double reliability_ratio = 0.1;
  /// Views beyond the three that fill what these do not see (SoftZCompositor); 0: the paper's three only. At most 16.
  int fill_views = 4;
  /// Views that are not used (held out).
  std::vector<std::size_t> excluded;
  void validate() const;
};

class ViewBasedRenderer : public Renderer {
 public:
  /// Other views are held out from now on; cheap. Throws Error{bad_input} where no view with triangles remains.
  virtual void exclude(std::vector<std::size_t> const& views) = 0;
  /// The views that render() would draw for this camera; ordered by view, the weights summing to 1.
  virtual std::vector<UsedView> view_weights(Camera const& camera,
                                             Eigen::Isometry3d const& object_from_camera) const = 0;
};

/// The paper's renderer: the views around the eye, blended with w = w_barycentric · w_cos · w_feather under soft
/// z-buffering. Holds what it needs of set and meshes (textures on the GPU); the context must outlive it. Views without
/// triangles are left out of the view sphere. A set without poses or with no mesh at all throws Error{bad_input}.
std::unique_ptr<ViewBasedRenderer> make_view_based_renderer(GlContext& context, ScanSet const& set,
                                                            std::vector<ViewMesh> const& meshes,
                                                            ViewBasedOptions const& options = {});

}  // namespace scanview
