#include "viewer/layered/ldi_traversal.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace scanview {
namespace {

/// Traversal for one camera.
class Traversal {
 public:
  Traversal(LdiTree const& tree, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
            TraversalOptions const& options)
      : tree_(tree),
        camera_(camera),
        camera_from_object_(object_from_camera.inverse()),
        options_(options),
        focal_(std::sqrt(camera.fx() * camera.fy())),
        near_(nearest_drawn(tree)) {}

  void visit(std::int32_t number) {
    LdiCell const& cell = tree_.cells[static_cast<std::size_t>(number)];
    TraversedCell at{number, false, false, 0, 0};
    if (!measure(cell, at)) return;
    if (cell.has_children() && double(at.stamp_px) > options_.stamp_px) {
      at.postponed = double(at.stamp_px) <= options_.until_px;
      at.descended = !at.postponed;
    }
    cells.push_back(at);
    if (at.descended) visit_children(cell);
  }

  void visit_children(LdiCell const& cell) {
    for (std::int32_t const child : cell.children)
      if (child >= 0) visit(child);
  }

  std::vector<TraversedCell> cells;

 private:
  /// False where the cell is outside of what the camera sees.
  bool measure(LdiCell const& cell, TraversedCell& at) const {
    Eigen::AlignedBox3d const box = tree_.box(cell);
    double const step = ldi_step(cell.key.level);
    // Tangent planes carry a splat beyond the box by no more than a step.
    Eigen::Vector3d const half = box.sizes() / 2 + Eigen::Vector3d::Constant(step);
    Eigen::Vector3d const middle = camera_from_object_ * box.center();
    Eigen::Matrix3d const& turn = camera_from_object_.linear();
    auto const reach = [&](Eigen::Vector3d const& direction) {
      return (turn.transpose() * direction).cwiseAbs().dot(half);
    };
    auto const outside = [&](Eigen::Vector3d const& inward, double offset) {
      return middle.dot(inward) + offset + reach(inward) < 0;
    };
    double const w = camera_.width() + 1, h = camera_.height() + 1;
    double const left = camera_.cx() + 1.5, right = w - 0.5 - camera_.cx(), top = camera_.cy() + 1.5,
                 bottom = h - 0.5 - camera_.cy();
    double const nearest = middle.z() - reach(Eigen::Vector3d::UnitZ());
    at.distance = static_cast<float>(middle.z());
    if (camera_.is_perspective()) {
      if (outside({0, 0, 1}, -near_) || outside({camera_.fx(), 0, left}, 0) || outside({-camera_.fx(), 0, right}, 0) ||
          outside({0, camera_.fy(), top}, 0) || outside({0, -camera_.fy(), bottom}, 0))
        return false;
      at.stamp_px =
          nearest > near_ ? static_cast<float>(step * focal_ / nearest) : std::numeric_limits<float>::infinity();
      return true;
    }
    if (outside({camera_.fx(), 0, 0}, left) || outside({-camera_.fx(), 0, 0}, right) ||
        outside({0, camera_.fy(), 0}, top) || outside({0, -camera_.fy(), 0}, bottom))
      return false;
    at.stamp_px = static_cast<float>(step * focal_);
    return true;
  }

  LdiTree const& tree_;
  Camera const& camera_;
  Eigen::Isometry3d camera_from_object_;
  TraversalOptions options_;
  double focal_, near_;
};

std::vector<TraversedCell> nearest_first(std::vector<TraversedCell> cells) {
  std::stable_sort(cells.begin(), cells.end(),
                   [](TraversedCell const& a, TraversedCell const& b) { return a.distance < b.distance; });
  return cells;
}

}  // namespace

std::vector<TraversedCell> traverse(LdiTree const& tree, Camera const& camera,
                                    Eigen::Isometry3d const& object_from_camera, TraversalOptions const& options) {
  Traversal traversal(tree, camera, object_from_camera, options);
  for (std::int32_t const root : tree.roots) traversal.visit(root);
  return nearest_first(std::move(traversal.cells));
}

std::vector<TraversedCell> traverse_below(LdiTree const& tree, std::vector<TraversedCell> const& postponed,
                                          Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                                          TraversalOptions const& options) {
  Traversal traversal(tree, camera, object_from_camera, options);
  for (TraversedCell const& at : postponed) traversal.visit_children(tree.cells[static_cast<std::size_t>(at.cell)]);
  return nearest_first(std::move(traversal.cells));
}

double nearest_drawn(LdiTree const& tree) { return tree.cells.empty() ? 0 : 4 * ldi_step(tree.cells.back().key.level); }

}  // namespace scanview
