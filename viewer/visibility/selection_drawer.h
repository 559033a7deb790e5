#pragma once
#include <span>
#include <vector>

#include "viewer/raster/triangle_bins.h"
#include "viewer/visibility/sample_camera.h"
#include "viewer/visibility/visibility_selector.h"

namespace scanview {

/// Draws choices of a mesh's triangles on the CPU back end (in tiles, on all threads), as a viewer does in each frame.
class SelectionDrawer {
 public:
  explicit SelectionDrawer(TriangleMesh const& drawn);
  /// Fills `ids` and `keys` with the picture.
  void draw(SampleCamera const& camera, std::span<IndexRange const> ranges);
  std::vector<std::uint32_t> const& ids() const { return ids_; }  ///< rows as wide as the camera
  std::vector<float> const& keys() const { return keys_; }        ///< −infinity: nothing

 private:
  RasterMesh chosen_;
  std::vector<std::int32_t> corners_;
  Eigen::AlignedBox3d bounds_;
  std::vector<std::uint32_t> ids_;
  std::vector<float> keys_;
};

}  // namespace scanview
