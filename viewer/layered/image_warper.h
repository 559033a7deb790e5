#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "acquire/scan_set.h"
#include "viewer/layered/image_warper_kernels.h"
#include "viewer/renderer.h"

namespace scanview {

/// 3-D warping of all reference images for every frame (McMillan and Bishop 1995), hidden surfaces by a z-buffer: the
/// peer that LDI trees are measured against (Chang, Bishop, Lastra 1998). Each pixel is the square of its stamp, as
/// large as the pixel is at its depth and facing the frame: side z / f there, f' / z' times that in the frame, at least
/// one pixel (so that equal resolution has no holes) and at most 2 kMostHalfStamp. Pixels whose centre lies in it show
/// it where nothing is nearer; equal depths: the lower view, row, column. Not blended, no holes filled. Points at or
/// behind a perspective eye are skipped; an orthographic frame has no near plane.
///
/// Equal bits on any number of threads and of any instruction set. Time grows with the references' pixels, whatever the
/// frame shows. Memory: 8 bytes a pixel of the references, 8 a pixel of the frame and a thread.
class ImageWarper final : public Renderer {
 public:
  /// Copies what it needs. Depths that are not finite, and those of perspective cameras that are not positive, are
  /// left out. `threads`: 0 for all processors. Throws Error{bad_input} naming a view without a pose, or whose colours
  /// do not have its camera's size, and where there are 2^32 depths or more.
  explicit ImageWarper(std::vector<View> const& views, int threads = 0);

  /// From now on without these views (indices into the constructor's); {} for all.
  void exclude(std::vector<std::size_t> const& views);
  /// Depths that a frame warps, without the excluded views'.
  std::size_t points() const;

  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override;

 private:
  struct Reference {
    Camera camera;
    Eigen::Isometry3d object_from_camera;
    std::size_t first_row = 0, end_row = 0;  ///< of rows_
    std::size_t points = 0;
    float farthest = 0;  ///< the largest depth, or its opposite
    bool excluded = false;
  };
  /// Rows of one reference.
  struct Piece {
    std::size_t warp, first_row, end_row;
  };
  /// A thread's own frame.
  struct Layer {
    std::vector<float> depth;
    std::vector<std::uint32_t> index;
  };

  void add(View const& view);
  ImageWarp warp_to(Camera const& camera, Eigen::Isometry3d const& object_from_camera, Reference const& from) const;
  std::vector<std::vector<Piece>> share(std::size_t threads) const;
  void compose(std::size_t layers, std::size_t begin, std::size_t end, Frame& frame) const;

  int threads_;
  std::vector<Reference> references_;
  std::vector<WarpRow> rows_;
  std::vector<float> depths_;          ///< of all rows, NaN where missing
  std::vector<std::uint32_t> colors_;  ///< beside them: BGRA
  std::vector<Layer> layers_;
};

}  // namespace scanview
