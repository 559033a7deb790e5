#pragma once
#include <memory>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/layered/ldi_renderer.h"
#include "viewer/window/measuring.h"
#include "viewer/window/traversed_cells.h"
#include "viewer/window/tree_look.h"

namespace scanview {

/// What the picture that is shown is made of.
struct TreeFigures {
  std::size_t cells = 0, splats = 0;
  double gaps = 0, uncovered = 0;  ///< shares of the pixels, LdiRenderer
  double milliseconds = 0;         ///< of all steps so far
  std::vector<LevelCount> levels;
};

/// An LDI tree that is being looked at: drawn in steps, so that an eye that moves need not wait, and with what a person
/// wants to know drawn over it.
class ViewedTree {
 public:
  /// options: those that looks leave alone. threads: at most so many; 0: all processors.
  ViewedTree(std::shared_ptr<LdiTree const> tree, LdiRenderOptions const& options, int threads);

  LdiTree const& tree() const { return renderer_.tree(); }
  /// From a camera of the picture's size; kept. A camera or a look that is new begins, with as many steps as fit into
  /// so many milliseconds (0: all); the same once more takes a further step. Damaged
  /// cells are left out, and failures() says so.
  cv::Mat4b render(Camera const& camera, Eigen::Isometry3d const& object_from_camera, TreeLook const& look,
                   double milliseconds);
  /// In one step, which is quicker than several.
  cv::Mat4b render_at_once(Camera const& camera, Eigen::Isometry3d const& object_from_camera, TreeLook const& look);
  /// Whether a further step would change nothing.
  bool is_complete() const { return renderer_.is_complete(); }
  bool has_failed() const { return !renderer_.damaged().empty(); }  ///< cells of the picture that is shown are damaged

  ShownFrame const& shown() const { return shown_; }  ///< without what is drawn over it
  TreeFigures const& figures() const { return figures_; }
  std::vector<TraversedCell> const& traversed() const { return renderer_.traversed(); }
  std::vector<std::string> const& failures() const { return failures_; }  ///< each once

 private:
  void begin(Camera const& camera, Eigen::Isometry3d const& object_from_camera, TreeLook const& look);
  void take_steps(bool goes_on, double milliseconds);
  void count(double milliseconds);
  cv::Mat4b painted();

  LdiRenderOptions options_;
  LdiRenderer renderer_;
  Context context_;
  TreeLook look_;
  ShownFrame shown_;
  TreeFigures figures_;
  std::vector<std::string> failures_;
};

}  // namespace scanview
