#include "viewer/window/traversed_cells.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <set>
#include <tuple>
#include <utility>

#include "base/parallel.h"
#include "viewer/window/line_drawing.h"

namespace scanview {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

LdiCell const& cell_of(LdiTree const& tree, TraversedCell const& at) {
  return tree.cells[static_cast<std::size_t>(at.cell)];
}

/// An edge of a cell along an axis, from a corner of its level's lattice.
struct Edge {
  bool bright = false;
  int coarse = 0;  ///< minus the level: darker, then coarser ones are drawn first
  int axis = 0;
  std::array<std::int64_t, 3> from{};
  bool operator==(Edge const&) const = default;
  bool operator<(Edge const& other) const {
    return std::tie(bright, coarse, axis, from) < std::tie(other.bright, other.coarse, other.axis, other.from);
  }
};

void add_edges(std::vector<Edge>& edges, LdiCellKey const& key, bool bright) {
  for (int axis = 0; axis < 3; ++axis)
    for (int side = 0; side < 4; ++side) {
      Edge edge{bright, -key.level, axis, key.index};
      edge.from[static_cast<std::size_t>((axis + 1) % 3)] += side & 1;
      edge.from[static_cast<std::size_t>((axis + 2) % 3)] += side >> 1;
      edges.push_back(edge);
    }
}

/// Finds the cell that a surface was drawn from.
class CellLocator {
 public:
  CellLocator(LdiTree const& tree, std::vector<TraversedCell> const& traversed)
      : tree_(tree), descended_(tree.cells.size(), 0) {
    for (TraversedCell const& at : traversed) descended_[static_cast<std::size_t>(at.cell)] = at.descended;
  }

  LdiCell const* at(Vector3d const& p) const {
    for (std::int32_t const root : tree_.roots)
      if (tree_.box(tree_.cells[static_cast<std::size_t>(root)]).contains(p)) return below(root, p);
    return nullptr;
  }

 private:
  LdiCell const* below(std::int32_t number, Vector3d const& p) const {
    for (;;) {
      LdiCell const& cell = tree_.cells[static_cast<std::size_t>(number)];
      Vector3d const middle = tree_.box(cell).center();
      std::size_t child = 0;
      for (int axis = 0; axis < 3; ++axis)
        if (p[axis] >= middle[axis]) child |= std::size_t{1} << axis;
      if (descended_[static_cast<std::size_t>(number)] == 0 || cell.children[child] < 0) return &cell;
      number = cell.children[child];
    }
  }

  LdiTree const& tree_;
  std::vector<std::uint8_t> descended_;
};

cv::Vec4b bgra(Eigen::Vector3f const& rgb) {
  auto const byte = [](float value) { return static_cast<std::uint8_t>(std::lround(255 * value)); };
  return {byte(rgb.z()), byte(rgb.y()), byte(rgb.x()), 255};
}

/// The map is drawn along the tree's axes.
Vector3d nearest_axis(Vector3d const& up) {
  Eigen::Index axis = 0;
  up.cwiseAbs().maxCoeff(&axis);
  return std::copysign(1.0, up[axis]) * Vector3d::Unit(axis);
}

}  // namespace

Eigen::Vector3f level_color(LdiTree const& tree, int level) {
  int const finest = tree.cells.back().key.level, coarsest = tree.cells.front().key.level;
  // From red to violet by hue.
  float const share = static_cast<float>(level - finest) / static_cast<float>(std::max(1, coarsest - finest));
  float const hue = 6 * 0.78F * share;
  auto const channel = [&](float peak) {
    float const off = std::abs(hue - peak);
    return std::clamp(2 - std::min(off, 6 - off), 0.0F, 1.0F);
  };
  return {channel(0), channel(2), channel(4)};
}

std::vector<LevelCount> count_levels(LdiTree const& tree, std::vector<TraversedCell> const& traversed) {
  std::map<int, LevelCount> counts;
  for (TraversedCell const& at : traversed) {
    int const level = cell_of(tree, at).key.level;
    LevelCount& count = counts[level];
    count.level = level;
    ++(at.descended ? count.descended : count.drawn);
  }
  std::vector<LevelCount> result;
  result.reserve(counts.size());
  for (auto const& [level, count] : counts) result.push_back(count);
  return result;
}

CellEdges cell_edges(LdiTree const& tree, std::vector<TraversedCell> const& traversed, ShownCells shown) {
  std::vector<Edge> edges;
  for (TraversedCell const& at : traversed) {
    if (shown == ShownCells::none || (at.descended && shown == ShownCells::drawn)) continue;
    add_edges(edges, cell_of(tree, at).key, !at.descended);
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  CellEdges result;
  for (Edge const& edge : edges) {
    LdiCellKey key{-edge.coarse, edge.from};
    for (int end = 0; end < 2; ++end) {
      result.vertices.push_back(ldi_corner(key, tree.options.resolution).cast<float>());
      ++key.index[static_cast<std::size_t>(edge.axis)];
    }
    int const last = static_cast<int>(result.vertices.size()) - 1;
    result.lines.emplace_back(last - 1, last);
    constexpr float kDark = 0.45F;
    result.colors.push_back(bgra((edge.bright ? 1 : kDark) * level_color(tree, -edge.coarse)));
  }
  return result;
}

void draw_cells(cv::Mat4b& picture, ShownFrame const& frame, LdiTree const& tree,
                std::vector<TraversedCell> const& traversed, ShownCells shown) {
  if (shown == ShownCells::none) return;
  CellEdges const edges = cell_edges(tree, traversed, shown);
  draw_seen_lines(picture, frame.frame.depth, frame.camera, frame.object_from_camera, edges.vertices, edges.lines,
                  edges.colors);
}

void tint_levels(cv::Mat4b& picture, ShownFrame const& frame, LdiTree const& tree,
                 std::vector<TraversedCell> const& traversed, Context& context) {
  CellLocator const locator(tree, traversed);
  constexpr int kBand = 16;
  auto const bands = static_cast<std::size_t>((picture.rows + kBand - 1) / kBand);
  for_each_index(context, bands, [&](std::size_t band) {
    int const top = static_cast<int>(band) * kBand, bottom = std::min(top + kBand, picture.rows);
    for (int y = top; y < bottom; ++y)
      for (int x = 0; x < picture.cols; ++x) {
        float const z = frame.frame.depth(y, x);
        if (!std::isfinite(z)) continue;
        LdiCell const* const cell = locator.at(frame.object_from_camera * frame.camera.unproject(x, y, z));
        if (cell == nullptr) continue;
        cv::Vec4b& pixel = picture(y, x);
        // As bright as the picture was, so that shapes stay visible.
        float const luma = (0.07F * pixel[0] + 0.72F * pixel[1] + 0.21F * pixel[2]) / 255;
        constexpr float kLeast = 0.3F;
        cv::Vec4b const color = bgra((kLeast + (1 - kLeast) * luma) * level_color(tree, cell->key.level));
        pixel = {color[0], color[1], color[2], pixel[3]};
      }
  });
}

std::optional<std::size_t> CellMap::nearest(Vector2d const& at, double reach) const {
  std::optional<std::size_t> best;
  for (Dot const& dot : views) {
    double const distance = (dot.at - at).norm();
    if (distance > reach) continue;
    reach = distance;
    best = dot.view;
  }
  return best;
}

CellMap cell_map(LdiTree const& tree, std::vector<TraversedCell> const& traversed, Vector3d const& up,
                 Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  Ground const ground(nearest_axis(up));
  auto const on_ground = [&](Vector3d const& p) { return GroundPlan::on_ground(ground, p); };
  Vector2d const middle = on_ground(tree.center);
  double reach = 1.2 * tree.radius;
  Eigen::AlignedBox2d extent(middle - Vector2d::Constant(reach), middle + Vector2d::Constant(reach));
  std::vector<std::pair<std::size_t, Vector3d>> near;
  for (std::size_t i = 0; i < tree.views.size(); ++i) {
    Vector3d const eye = tree.views[i].eye();
    double const distance = (on_ground(eye) - middle).norm();
    if (!tree.views[i].image.camera.is_perspective() || distance > 2 * tree.radius) continue;
    near.emplace_back(i, eye);
    extent.extend(on_ground(eye));
    reach = std::max(reach, distance);
  }
  GroundPlan const plan(ground, extent, tree.radius);

  CellMap map;
  for (auto const& [view, eye] : near) map.views.push_back({view, plan.place(eye)});
  Eigen::Index upright = 0;
  ground.up.cwiseAbs().maxCoeff(&upright);
  std::set<std::pair<int, std::array<std::int64_t, 3>>> columns;  // minus the level
  for (TraversedCell const& at : traversed) {
    LdiCellKey key = cell_of(tree, at).key;
    key.index[static_cast<std::size_t>(upright)] = 0;
    if (!at.descended) columns.emplace(-key.level, key.index);
  }
  for (auto const& [coarse, index] : columns) {
    LdiCellKey key{-coarse, index};
    Vector2d const a = plan.place(ldi_corner(key, tree.options.resolution));
    for (std::int64_t& along : key.index) ++along;
    Vector2d const b = plan.place(ldi_corner(key, tree.options.resolution));
    map.cells.push_back({a.cwiseMin(b), a.cwiseMax(b), level_color(tree, key.level)});
  }

  Vector3d eye = object_from_camera.translation();
  double const away = (on_ground(eye) - middle).norm();
  if (away > reach) eye = tree.center + reach / away * (eye - tree.center);
  // Straight down, what is up in the picture is ahead.
  Vector3d const ahead = object_from_camera.linear().col(2) - 1e-3 * object_from_camera.linear().col(1);
  double const heading = std::atan2(ahead.dot(ground.east), ahead.dot(ground.north));
  double const width = camera.is_perspective() ? 2 * std::atan(0.5 * camera.width() / camera.fx()) : 0;
  constexpr double kRadian = 180 / std::numbers::pi;
  plan.add_eye_and_bar(map, eye, kRadian * heading, kRadian * width);
  return map;
}

}  // namespace scanview
