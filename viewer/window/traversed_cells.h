#pragma once
#include <Eigen/Core>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <vector>

#include "base/context.h"
#include "viewer/layered/ldi_traversal.h"
#include "viewer/window/ground_map.h"
#include "viewer/window/measuring.h"
#include "viewer/window/tree_look.h"

namespace scanview {

/// The colour of a tree's level, R G B as shown: red for the finest, over yellow, green and blue to the coarsest.
Eigen::Vector3f level_color(LdiTree const& tree, int level);

/// Cells of a picture, level by level.
struct LevelCount {
  int level = 0;
  std::size_t drawn = 0;      ///< nothing of them was left to children
  std::size_t descended = 0;  ///< their children are drawn, too
};
/// Finest first; levels without cells are left out.
std::vector<LevelCount> count_levels(LdiTree const& tree, std::vector<TraversedCell> const& traversed);

/// Edges of cells' boxes, each once, in level_color(); coarser levels first. Of descended cells darker and before all
/// others.
struct CellEdges {
  std::vector<Eigen::Vector3f> vertices;  ///< object coordinates
  std::vector<Eigen::Vector2i> lines;
  std::vector<cv::Vec4b> colors;  ///< BGRA, of each line
};
CellEdges cell_edges(LdiTree const& tree, std::vector<TraversedCell> const& traversed, ShownCells shown);
/// Draws them over a picture of the frame's size, where its surfaces do not hide them.
void draw_cells(cv::Mat4b& picture, ShownFrame const& frame, LdiTree const& tree,
                std::vector<TraversedCell> const& traversed, ShownCells shown);

/// Gives each pixel the colour of the level that its surface was drawn from: that of the deepest traversed cell in
/// which it lies. (What fills a gap comes from further up.)
void tint_levels(cv::Mat4b& picture, ShownFrame const& frame, LdiTree const& tree,
                 std::vector<TraversedCell> const& traversed, Context& context);

/// Traversed cells from above (Chang 1998, figure 7), the reference views near the scene, and the eye; one that is
/// farther away than all these is drawn at the rim.
struct CellMap : GroundMap {
  struct Cell {
    Eigen::Vector2d low{0, 0}, high{0, 0};
    Eigen::Vector3f color{0, 0, 0};  ///< level_color()
  };
  struct Dot {
    std::size_t view = 0;
    Eigen::Vector2d at{0, 0};
  };
  std::vector<Cell> cells;  ///< those that are drawn, coarser first; of cells that lie above one another one
  std::vector<Dot> views;
  /// The view whose dot is nearest to a place and within `reach` of it; nothing where there is none.
  std::optional<std::size_t> nearest(Eigen::Vector2d const& at, double reach) const;
};
/// The map's axes are the tree's: those two that are most level where `up` is up.
CellMap cell_map(LdiTree const& tree, std::vector<TraversedCell> const& traversed, Eigen::Vector3d const& up,
                 Camera const& camera, Eigen::Isometry3d const& object_from_camera);

}  // namespace scanview
