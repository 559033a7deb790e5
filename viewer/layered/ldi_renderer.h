#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "base/context.h"
#include "viewer/layered/ldi_traversal.h"
#include "viewer/layered/splat_canvas.h"
#include "viewer/layered/square_canvas.h"
#include "viewer/renderer.h"

namespace scanview {

struct LdiRenderOptions {
  /// TraversalOptions: greater is faster and more blurred.
  double stamp_px = 1;
  /// blended: the paper's, into a layered buffer. squares: the nearest pixel of a cell wins; some times as fast,
  /// rougher, gaps stay.
  enum class Splats { blended, squares } splats = Splats::blended;
  /// What is drawn where no pixel of the traversed cells is: nothing; or filtered pixels of the cells above them, the
  /// finest first (Chang 1998, §3.5).
  enum class Gaps { background, filled } gaps = Gaps::filled;
  /// Pixels that are covered less are gaps, 0 to 1.
  double covered = 0.5;

  void validate() const;  ///< Throws Error{usage} naming the field and its range.
};

/// Draws an LDI tree (Chang, Bishop, Lastra 1998, §3.2 to 3.5) on the processor's cores. The picture does not depend on
/// the number of threads. Some 12 million blended splats a second and core, or 70 million squares.
class LdiRenderer : public Renderer {
 public:
  LdiRenderer(std::shared_ptr<LdiTree const> tree, LdiRenderOptions const& options, int threads = 0);

  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override;

  /// A picture in steps (§3.4): begin(), then refine() until it says that nothing is left. The first step is of
  /// squares, of cells whose steps are kFirstPx pixels on the screen: a tenth of the whole. Then blended splats of
  /// these cells, and in each following step of cells of half as many pixels; what has been drawn for good is not drawn
  /// again. Splats::squares takes two steps. picture() at any time: what the last step made; empty before begin(), when
  /// nothing is left to refine either.
  void begin(Camera const& camera, Eigen::Isometry3d const& object_from_camera);
  bool refine();
  Frame picture();
  /// As many steps as fit into so many milliseconds, judged by those of the picture before; at least the first.
  Frame render_within(double milliseconds, Camera const& camera, Eigen::Isometry3d const& object_from_camera);
  static constexpr double kFirstPx = 4;

  // Of the last picture:
  std::vector<TraversedCell> const& traversed() const { return traversed_; }
  std::size_t splats() const { return splats_ + filling_splats_; }
  std::size_t filling_splats() const { return filling_splats_; }  ///< those of them that were to fill gaps
  /// Pixels that nothing covered before gaps were filled, and after.
  std::size_t gaps() const { return gaps_; }
  std::size_t uncovered() const { return uncovered_; }
  /// Cells of the tree's file that are damaged, and why: they were left out.
  std::map<std::int32_t, std::string> const& damaged() const { return damaged_; }
  bool is_complete() const { return is_complete_; }
  std::map<std::string, double> const& stages() const { return stages_; }  ///< milliseconds

  LdiTree const& tree() const { return *tree_; }
  LdiRenderOptions options;

 private:
  void draw(std::vector<TraversedCell> const& cells);
  std::size_t draw_on(SplatCanvas& canvas, std::vector<CellPart> const& parts, cv::Mat1b const& stencil);
  Frame draw_squares(std::vector<TraversedCell> const& cells);
  void refine_blended(TraversalOptions how);
  double next_step_milliseconds(double first) const;
  void fill_gaps(Frame& frame);
  std::pair<int, int> touched(int y) const;
  std::size_t find_gaps(Frame const& frame, cv::Mat1b& stencil);
  void close_seams(cv::Mat1b const& stencil, Frame& frame);
  void for_each_rows(int rows, std::function<void(int)> const& work);

  std::shared_ptr<LdiTree const> tree_;
  Context context_;
  Camera camera_;
  Eigen::Isometry3d object_from_camera_;
  /// What is drawn for good, and the filtered pixels of cells that were postponed.
  SplatCanvas lasting_, passing_, filling_;
  SquareCanvas squares_;
  bool has_passing_ = false, is_complete_ = true;
  int steps_ = 0;          ///< done
  bool is_rough_ = false;  ///< what has been drawn are squares
  Frame rough_;            ///< of these, until picture() hands it out
  double until_px_ = 0;
  std::vector<double> step_milliseconds_;  ///< of the last picture in steps, and what it took to finish it
  double finish_milliseconds_ = 0;
  std::vector<TraversedCell> traversed_, postponed_;
  std::size_t splats_ = 0, filling_splats_ = 0, gaps_ = 0, uncovered_ = 0;
  std::map<std::int32_t, std::string> damaged_;
  std::map<std::string, double> stages_;
};

}  // namespace scanview
