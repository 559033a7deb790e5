#include "cli/octree_drawing.h"

#include <fmt/format.h>

#include <map>
#include <set>

namespace scanview {
namespace {

constexpr double kDrawingWidth = 760;

/// Scene coordinates seen from the end of an axis: right and down on the page.
struct TopView {
  int axis = 0;
  double sign = 1;
  Eigen::Vector2d low{0, 0};
  double scale = 1;

  Eigen::Vector2d flat(Eigen::Vector3d const& p) const { return {sign * p[(axis + 2) % 3], p[(axis + 1) % 3]}; }
  Eigen::Vector2d place(Eigen::Vector3d const& p) const { return scale * (flat(p) - low); }
};

std::string eyes(LdiTree const& tree, TopView const& from) {
  std::string svg;
  double const reach = 0.06 * kDrawingWidth;
  for (View const& view : tree.views) {
    if (!view.image.camera.is_perspective()) continue;
    Eigen::Vector2d const eye = from.place(view.eye());
    std::string lines;
    for (double const u : {-0.5, view.image.camera.width() - 0.5}) {
      Eigen::Vector3d const ray = view.image.camera.ray_direction(u, view.image.camera.cy());
      Eigen::Vector2d const along = from.flat(view.object_from_camera->linear() * ray);
      if (!(along.norm() > 0)) continue;
      Eigen::Vector2d const end = eye + reach * along.normalized();
      lines += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", eye.x(), eye.y(), end.x(), end.y());
    }
    svg += fmt::format(
        "<path d=\"{}\" fill=\"none\" stroke=\"#c00\"/><circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"3\" "
        "fill=\"#c00\"/>",
        lines, eye.x(), eye.y());
  }
  return svg;
}

}  // namespace

std::string svg_octree(LdiTree const& tree, Eigen::Vector3d const& up) {
  TopView from;
  up.cwiseAbs().maxCoeff(&from.axis);
  from.sign = up[from.axis] < 0 ? -1 : 1;
  Eigen::AlignedBox2d page;
  std::map<int, std::set<std::pair<std::int64_t, std::int64_t>>> columns;
  for (LdiCell const& cell : tree.cells) {
    // Those at the top may be much larger than the scene, and are cut.
    if (!cell.has_children()) {
      page.extend(from.flat(tree.box(cell).min()));
      page.extend(from.flat(tree.box(cell).max()));
    }
    columns[cell.key.level].insert(
        {cell.key.index[std::size_t(from.axis + 2) % 3], cell.key.index[std::size_t(from.axis + 1) % 3]});
  }
  for (View const& view : tree.views)
    if (view.image.camera.is_perspective()) page.extend(from.flat(view.eye()));
  constexpr double kRim = 4;
  from.scale = (kDrawingWidth - 2 * kRim) / page.sizes().x();
  from.low = page.min() - Eigen::Vector2d::Constant(kRim / from.scale);
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {1:.0f}\" width=\"{0}\" style=\"max-width:100%;background:#fff\" role=\"img\">",
      kDrawingWidth, from.scale * page.sizes().y() + 2 * kRim);
  double const levels = double(columns.size());
  double drawn = 0;
  for (auto level = columns.rbegin(); level != columns.rend(); ++level, ++drawn) {
    std::string boxes;
    for (auto const& [right, down] : level->second) {
      LdiCellKey key{level->first, {}};
      key.index[std::size_t(from.axis + 2) % 3] = right;
      key.index[std::size_t(from.axis + 1) % 3] = down;
      Eigen::Vector3d const corner = ldi_corner(key, tree.options.resolution);
      double const side = tree.options.resolution * ldi_step(key.level);
      Eigen::Vector2d const a = from.place(corner), b = from.place(corner + Eigen::Vector3d::Constant(side));
      boxes += fmt::format("M{:.1f} {:.1f}H{:.1f}V{:.1f}H{:.1f}Z", a.x(), a.y(), b.x(), b.y(), a.x());
    }
    svg += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"hsl({:.0f} 70% 40%)\" stroke-width=\"{:.1f}\"/>", boxes,
                       220 - 190 * drawn / std::max(1.0, levels - 1), drawn < 2 ? 1.2 : 0.7);
  }
  return svg + eyes(tree, from) + "</svg>\n";
}

}  // namespace scanview
