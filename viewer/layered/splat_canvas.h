#pragma once
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/context.h"
#include "viewer/layered/ldi_tree.h"
#include "viewer/layered/splat_kernels.h"
#include "viewer/renderer.h"

namespace scanview {

/// Blocks of a cell that are to be drawn. Patches only add to what covers a pixel less than once.
struct CellPart {
  std::int32_t cell = 0;
  LdiKind kind = LdiKind::unfiltered;
};

/// What becomes of a cell's grid on the screen: from steps along a face's axes (x, y, depth, 1) to u, v (times depth
/// where perspective) and depth.
Eigen::Matrix<double, 3, 4> screen_from_grid(LdiTree const& tree, LdiCell const& cell, int face, Camera const& camera,
                                             Eigen::Isometry3d const& camera_from_object);

/// The layered output buffer of a picture, in bands of rows that are drawn in parallel; what a pixel becomes depends on
/// the order of what is drawn alone.
class SplatCanvas {
 public:
  /// Empty, of the camera's size.
  void begin(Camera const& camera, Eigen::Isometry3d const& object_from_camera);
  /// Splats in this order; nearest first is fastest. `stencil`: where it is 0 nothing is drawn (empty: everywhere).
  /// Returns the number of splats: one that lies in two bands counts twice. Damaged cells are left out: damaged().
  std::size_t draw(LdiTree const& tree, std::vector<CellPart> const& parts, cv::Mat1b const& stencil, Context& context);
  /// Cells that the last draw() left out, and why (LdiTree::blocks).
  std::map<std::int32_t, std::string> const& damaged() const { return damaged_; }
  /// The layers composed from the front (§3.3), of this canvas and, where there is one, of another that was begun for
  /// the same camera. Returns the number of pixels whose alpha is less than `least_alpha`.
  std::size_t compose(SplatCanvas const* more, std::uint32_t least_alpha, Frame& frame, Context& context) const;
  /// Columns [first, second) of a row in which something may have been drawn.
  std::pair<int, int> touched(int y) const {
    Touched const& band = touched_[static_cast<std::size_t>(y / kBand)];
    return {std::min(band.left, band.right), band.right};
  }
  /// Draws what this canvas holds beneath a picture, where the stencil is not 0. Of what covers a place by no more than
  /// a half nothing is drawn: what is filtered reaches beyond outlines.
  void fill_beneath(cv::Mat1b const& stencil, Frame& frame, Context& context) const;

 private:
  struct DrawnBlock;
  struct DrawnCell;
  static constexpr int kBand = 32;
  std::size_t bands() const { return static_cast<std::size_t>((camera_.height() + kBand - 1) / kBand); }
  OutputArea area(std::size_t band, cv::Mat1b const& stencil) const;
  /// Pixels from row to row: at least one more on both sides, which kernels may write to. 512 bytes beyond a multiple
  /// of 4096: sixteen pixels of each of sixteen rows do not push one another out of the nearest cache.
  std::size_t stride() const { return (static_cast<std::size_t>(camera_.width()) + 2 + 111) / 128 * 128 + 16; }

  Camera camera_;
  Eigen::Isometry3d camera_from_object_;
  std::size_t capacity_ = 0;
  std::unique_ptr<OutputLayer[]> layers_;
  std::size_t layer_size_ = 0;
  std::vector<std::uint8_t> counts_;
  struct Touched {
    int left = 1 << 30, right = 0;  ///< columns in which something may have been drawn
  };
  std::vector<Touched> touched_;  ///< of each band
  std::map<std::int32_t, std::string> damaged_;
};

}  // namespace scanview
