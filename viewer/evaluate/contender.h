#pragma once
#include <memory>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/renderer.h"
#include "viewer/view_based/view_based_renderer.h"

namespace scanview {

/// A renderer of a set that can do without some of its views.
class HeldOutRenderer : public Renderer {
 public:
  /// From now on without these views. Throws Error{bad_input} where none is left.
  virtual void exclude(std::vector<std::size_t> const& views) = 0;
};

/// Somebody who draws a set, to be compared with others.
struct Contender {
  std::string name;   ///< key of the report: "view_based"
  std::string title;  ///< "unstructured lumigraph (k = 4)"
  std::unique_ptr<HeldOutRenderer> renderer;
};

/// Ours with the CPU rasteriser (first: the one all others are compared with), the nearest view alone, a z-buffered
/// collage of the views around the eye, the unstructured lumigraph, the LDI tree (built by exclude(), or by the first
/// frame where nothing is excluded), of perspective views the walkthrough (each view a node), and where the program was
/// built with Open3D (SCANVIEW_OPEN3D) a fused mesh with vertex colours. `set` has its images (trees and the fused mesh
/// are made of depths).
std::vector<Contender> make_contenders(ScanSet const& set, std::shared_ptr<ViewLibrary> library,
                                       ViewBasedOptions const& options, Context& context);

}  // namespace scanview
