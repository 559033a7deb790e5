#include "viewer/window/viewed_tree.h"

#include <algorithm>
#include <chrono>
#include <utility>
namespace scanview {
namespace {

double now() {
  return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Whether both looks are drawn by the same steps.
bool same_steps(TreeLook const& a, TreeLook const& b) {
  return a.stamp_px == b.stamp_px && (a.gaps == TreeGaps::filled) == (b.gaps == TreeGaps::filled);
}

}  // namespace

ViewedTree::ViewedTree(std::shared_ptr<LdiTree const> tree, LdiRenderOptions const& options, int threads)
    : options_(options), renderer_(std::move(tree), options, threads) {
  context_.threads = threads;
}

void ViewedTree::begin(Camera const& camera, Eigen::Isometry3d const& object_from_camera, TreeLook const& look) {
  renderer_.options = with_tree_look(options_, look);
  shown_.camera = camera;
  shown_.object_from_camera = object_from_camera;
  look_ = look;
  figures_.milliseconds = 0;
}

cv::Mat4b ViewedTree::render(Camera const& camera, Eigen::Isometry3d const& object_from_camera, TreeLook const& look,
                             double milliseconds) {
  bool const goes_on = !shown_.frame.color.empty() && camera == shown_.camera &&
                       object_from_camera.matrix() == shown_.object_from_camera.matrix() && same_steps(look, look_);
  if (!goes_on) begin(camera, object_from_camera, look);
  look_ = look;
  if (goes_on && is_complete()) return painted();
  double const start = now();
  take_steps(goes_on, milliseconds);
  count(now() - start);
  return painted();
}

void ViewedTree::take_steps(bool goes_on, double milliseconds) {
  if (!goes_on && milliseconds > 0) {
    shown_.frame = renderer_.render_within(milliseconds, shown_.camera, shown_.object_from_camera);
    return;
  }
  if (!goes_on) renderer_.begin(shown_.camera, shown_.object_from_camera);
  while (renderer_.refine() && milliseconds == 0) continue;
  shown_.frame = renderer_.picture();
}

cv::Mat4b ViewedTree::render_at_once(Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                                     TreeLook const& look) {
  begin(camera, object_from_camera, look);
  double const start = now();
  shown_.frame = renderer_.render(camera, object_from_camera);
  count(now() - start);
  return painted();
}

void ViewedTree::count(double milliseconds) {
  auto const pixels = static_cast<double>(shown_.frame.color.total());
  figures_.cells = renderer_.traversed().size();
  figures_.splats = renderer_.splats();
  figures_.gaps = static_cast<double>(renderer_.gaps()) / pixels;
  figures_.uncovered = static_cast<double>(renderer_.uncovered()) / pixels;
  figures_.milliseconds += milliseconds;
  figures_.levels = count_levels(tree(), renderer_.traversed());
  for (auto const& [cell, why] : renderer_.damaged())
    if (std::find(failures_.begin(), failures_.end(), why) == failures_.end()) failures_.push_back(why);
}

cv::Mat4b ViewedTree::painted() {
  cv::Mat4b picture = shown_.frame.color.clone();
  if (look_.levels) tint_levels(picture, shown_, tree(), traversed(), context_);
  if (look_.gaps == TreeGaps::magenta) paint_gaps(picture, options_.covered);
  draw_cells(picture, shown_, tree(), traversed(), look_.cells);
  return picture;
}

}  // namespace scanview
