#include "viewer/layered/ldi_tree.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/error.h"
#include "viewer/layered/ldi_content.h"

namespace scanview {
namespace {

void check_range(double value, double least, double most, char const* name, char const* range) {
  if (!(value >= least && value <= most)) throw Error(ErrorCode::usage, {}, std::string(name) + ": must be " + range);
}

/// Whether the blocks lie within the cell, have its pixels among them and come kind after kind: the hash is no proof,
/// as whoever makes a file can make it fit.
bool are_sound(std::span<LdiBlock const> blocks, LdiCell const& cell, int resolution) {
  std::size_t const patches = cell.blocks_of_kind[0], filtered = patches + cell.blocks_of_kind[1];
  std::uint64_t pixels = 0;
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    LdiBlock const& block = blocks[i];
    LdiKind const kind = i < patches ? LdiKind::unfiltered : i < filtered ? LdiKind::patch : LdiKind::filtered;
    if (block.count == 0 || block.count > LdiBlock::kMost || block.first != pixels || block.face >= kLdiFaces ||
        block.kind != kind)
      return false;
    for (int k = 0; k < 3; ++k)
      if (block.low[k] > block.high[k] || block.high[k] >= resolution) return false;
    pixels += block.count;
  }
  return pixels == cell.pixels;
}

}  // namespace

void LdiOptions::validate() const {
  check_range(resolution, kLdiLeastResolution, kLdiGreatestResolution, "resolution", "1 to 256");
  check_range(coarseness, 0.25, 4, "coarseness", "0.25 to 4");
  check_range(smallest_feature, 0, 1e30, "smallest_feature", "0 or more");
  check_range(merge_steps, 0, 1, "merge_steps", "0 to 1");
  check_range(depth_error, 0, 1e30, "depth_error", "0 or more");
  check_range(covered, 0, 1, "covered", "0 to 1");
}

int LdiOptions::bin_shift(int level) const {
  int shift = 0;
  while ((2 << shift) <= resolution && ldi_step(level) * (2 << shift) <= depth_error) ++shift;
  return shift;
}

double LdiOptions::step_limit() const {
  return smallest_feature > 0 ? ldi_step(static_cast<int>(std::floor(std::log2(smallest_feature)))) : 0;
}

bool LdiCell::has_children() const {
  return std::any_of(children.begin(), children.end(), [](std::int32_t child) { return child >= 0; });
}

std::uint64_t LdiTree::content_bytes(LdiCell const& cell) { return LdiLayout(cell.blocks(), cell.pixels).end; }

std::span<LdiBlock const> LdiTree::blocks(LdiCell const& cell) const {
  std::span<LdiBlock const> const blocks(
      static_cast<LdiBlock const*>(static_cast<void const*>(content.data() + cell.offset)), cell.blocks());
  if (checked) {
    std::size_t const number = static_cast<std::size_t>(&cell - cells.data());
    std::atomic_ref<std::uint8_t> mark((*checked)[number]);
    if (mark.load(std::memory_order_relaxed) == 0) {
      if (XXH3_64bits(content.data() + cell.offset, content_bytes(cell)) != cell.hash)
        throw Error(ErrorCode::bad_input, path, "is damaged: a cell's pixels are not those that were written");
      if (!are_sound(blocks, cell, options.resolution))
        throw Error(ErrorCode::bad_input, path, "is damaged: a cell's blocks do not lie within it");
      mark.store(1, std::memory_order_relaxed);
    }
  }
  return blocks;
}

LdiPixels LdiTree::pixels(LdiCell const& cell) const {
  return ldi_pixels(content.data() + cell.offset, cell.blocks(), cell.pixels);
}

std::size_t LdiTree::pixel_count() const {
  std::size_t count = 0;
  for (LdiCell const& cell : cells) count += cell.pixels;
  return count;
}

std::size_t LdiTree::bytes() const { return content.size() + cells.size() * sizeof(LdiCell); }

Eigen::AlignedBox3d LdiTree::box(LdiCell const& cell) const {
  Eigen::Vector3d const corner = ldi_corner(cell.key, options.resolution);
  double const side = options.resolution * ldi_step(cell.key.level);
  return {corner, corner + Eigen::Vector3d::Constant(side)};
}

void LdiTree::place_object() {
  struct Weighted {
    double at;
    double weight;
  };
  std::vector<Eigen::Vector3d> points;
  std::vector<double> weights;
  double total = 0;
  auto const coarsest = std::find_if(cells.begin(), cells.end(), [](LdiCell const& cell) { return cell.pixels > 0; });
  for (auto it = coarsest; it != cells.end() && it->key.level == coarsest->key.level; ++it) {
    LdiCell const& cell = *it;
    Eigen::Vector3d const corner = ldi_corner(cell.key, options.resolution);
    double const step = ldi_step(cell.key.level);
    LdiPixels const p = pixels(cell);
    for (LdiBlock const& block : blocks(cell))
      for (std::uint32_t i = block.first; i < block.first + block.count; ++i) {
        Eigen::Vector3d at;
        int const axis = block.face / 2;
        at[(axis + 1) % 3] = p.x[i] + 0.5;
        at[(axis + 2) % 3] = p.y[i] + 0.5;
        at[axis] = double(p.depth[i]) * options.resolution / 65536;
        points.push_back(corner + step * at);
        weights.push_back(p.color[i] >> 24);
        total += weights.back();
      }
  }
  // The value that so much of the weight lies below.
  auto const quantile = [&](double share, auto const& value) {
    std::vector<Weighted> all;
    for (std::size_t i = 0; i < points.size(); ++i) all.push_back({value(points[i]), weights[i]});
    std::sort(all.begin(), all.end(), [](Weighted const& a, Weighted const& b) { return a.at < b.at; });
    double sum = 0;
    for (Weighted const& one : all)
      if ((sum += one.weight) >= share * total) return one.at;
    return 0.0;
  };
  for (int k = 0; k < 3; ++k) center[k] = quantile(0.5, [&](Eigen::Vector3d const& p) { return p[k]; });
  radius = quantile(0.99, [&](Eigen::Vector3d const& p) { return (p - center).norm(); });
  if (!(radius > 0)) radius = ldi_step(cells[0].key.level);
}

}  // namespace scanview
