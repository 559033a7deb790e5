#pragma once
#include <cstddef>
#include <map>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/layered/ldi_tree.h"
#include "viewer/layered/splat_canvas.h"
#include "viewer/layered/square_kernels.h"
#include "viewer/renderer.h"

namespace scanview {

/// An LDI tree's pixels as squares behind which everything is hidden: several times as fast as the blended splats of
/// SplatCanvas, and as rough as warped images are.
class SquareCanvas {
 public:
  /// Draws parts of cells for a camera, nearest first is fastest. Equal pictures in any order and on any number of
  /// threads. Returns the number of LDI pixels that were looked at. Damaged cells are left out: damaged().
  std::size_t draw(LdiTree const& tree, std::vector<CellPart> const& parts, Camera const& camera,
                   Eigen::Isometry3d const& object_from_camera, Frame& frame, Context& context);

  /// Cells that the last draw() left out, and why (LdiTree::blocks).
  std::map<std::int32_t, std::string> const& damaged() const { return damaged_; }

 private:
  /// A thread's own picture.
  struct Layer {
    std::vector<float> depth;
    std::vector<SquareSample> samples;
  };
  std::vector<Layer> layers_;
  std::map<std::int32_t, std::string> damaged_;
};

}  // namespace scanview
