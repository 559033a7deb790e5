#include "viewer/layered/ldi_content.h"

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <algorithm>
#include <cstring>
#include <tuple>

namespace scanview {
namespace {

constexpr int kTile = 4;  // blocks are 16 grid points wide

std::uint8_t step_of(std::uint16_t depth, int resolution) {
  return static_cast<std::uint8_t>(std::uint32_t{depth} * static_cast<std::uint32_t>(resolution) >> 16);
}

}  // namespace

LdiLayout::LdiLayout(std::size_t blocks, std::size_t pixels)
    : color(blocks * sizeof(LdiBlock)),
      depth(color + 4 * pixels),
      x(depth + 2 * pixels),
      y(x + pixels),
      slope_x(y + pixels),
      slope_y(slope_x + pixels),
      end((slope_y + pixels + 15) / 16 * 16) {}

LdiPixels ldi_pixels(std::byte const* content, std::size_t blocks, std::size_t pixels) {
  LdiLayout const layout(blocks, pixels);
  auto const at = [&](std::size_t offset) { return static_cast<void const*>(content + offset); };
  return {static_cast<std::uint8_t const*>(at(layout.x)),      static_cast<std::uint8_t const*>(at(layout.y)),
          static_cast<std::uint16_t const*>(at(layout.depth)), static_cast<std::uint32_t const*>(at(layout.color)),
          static_cast<std::int8_t const*>(at(layout.slope_x)), static_cast<std::int8_t const*>(at(layout.slope_y))};
}

LdiContent::LdiContent(std::vector<Pixel> pixels, int resolution) : pixels_(pixels.size()) {
  if (pixels.empty()) return;
  auto const slab = [&](Pixel const& p) { return step_of(p.depth, resolution) >> kTile; };
  auto const tile = [](Pixel const& p) { return std::make_tuple(p.kind, p.face, p.y >> kTile, p.x >> kTile); };
  std::sort(pixels.begin(), pixels.end(), [&](Pixel const& a, Pixel const& b) {
    auto const place = [&](Pixel const& p) { return std::make_tuple(slab(p), p.y, p.x, p.depth, p.color); };
    auto const tile_a = tile(a), tile_b = tile(b);
    return tile_a != tile_b ? tile_a < tile_b : place(a) < place(b);
  });
  std::vector<LdiBlock> blocks;
  for (std::size_t i = 0; i < pixels.size(); ++i) {
    Pixel const& p = pixels[i];
    bool const goes_on = i > 0 && tile(p) == tile(pixels[i - 1]) && slab(p) - slab(pixels[i - 1]) <= 1 &&
                         blocks.back().count < LdiBlock::kMost;
    std::uint8_t const at[3] = {p.x, p.y, step_of(p.depth, resolution)};
    if (!goes_on) {
      LdiBlock block;
      block.first = static_cast<std::uint32_t>(i);
      block.face = p.face;
      block.kind = p.kind;
      std::copy(at, at + 3, block.low);
      std::copy(at, at + 3, block.high);
      blocks.push_back(block);
      ++blocks_of_kind_[static_cast<std::size_t>(p.kind)];
    }
    LdiBlock& block = blocks.back();
    ++block.count;
    for (int k = 0; k < 3; ++k) {
      block.low[k] = std::min(block.low[k], at[k]);
      block.high[k] = std::max(block.high[k], at[k]);
    }
  }
  blocks_ = blocks.size();
  LdiLayout const layout(blocks_, pixels_);
  bytes_.resize(layout.end + kLdiPadding);
  std::memcpy(bytes_.data(), blocks.data(), blocks_ * sizeof(LdiBlock));
  auto const fill = [&](std::size_t offset, auto const& value) {
    using Value = decltype(value(pixels[0]));
    std::byte* to = bytes_.data() + offset;
    for (Pixel const& p : pixels) {
      Value const v = value(p);
      std::memcpy(to, &v, sizeof v);
      to += sizeof v;
    }
  };
  fill(layout.color, [](Pixel const& p) { return p.color; });
  fill(layout.depth, [](Pixel const& p) { return p.depth; });
  fill(layout.x, [](Pixel const& p) { return p.x; });
  fill(layout.y, [](Pixel const& p) { return p.y; });
  fill(layout.slope_x, [](Pixel const& p) { return p.slope_x; });
  fill(layout.slope_y, [](Pixel const& p) { return p.slope_y; });
  bytes_.resize(layout.end + kLdiPadding);
}

std::span<LdiBlock const> LdiContent::blocks() const {
  return {static_cast<LdiBlock const*>(static_cast<void const*>(bytes_.data())), blocks_};
}

LdiPixels LdiContent::pixels() const { return ldi_pixels(bytes_.data(), blocks_, pixels_); }

bool link_cells(std::vector<LdiCell>& cells, std::vector<std::int32_t>& roots) {
  roots.clear();
  std::unordered_map<LdiCellKey, std::int32_t, LdiCellKeyHash> numbers;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    LdiCell& cell = cells[i];
    if (i > 0 && !(std::make_tuple(-cells[i - 1].key.level, cells[i - 1].key.index) <
                   std::make_tuple(-cell.key.level, cell.key.index)))
      return false;
    numbers[cell.key] = static_cast<std::int32_t>(i);
    cell.children.fill(-1);
    if (cell.key.level == cells[0].key.level) {
      roots.push_back(static_cast<std::int32_t>(i));
      continue;
    }
    auto const parent = numbers.find(cell.key.parent());
    if (parent == numbers.end()) return false;
    std::size_t which = 0;
    for (std::size_t k = 0; k < 3; ++k) which |= static_cast<std::size_t>(cell.key.index[k] & 1) << k;
    cells[static_cast<std::size_t>(parent->second)].children[which] = static_cast<std::int32_t>(i);
  }
  return roots.size() <= 8;
}

LdiTree tree_of(std::unordered_map<LdiCellKey, LdiContent, LdiCellKeyHash>&& contents, LdiOptions const& options) {
  LdiTree tree;
  tree.options = options;
  for (auto const& [key, content] : contents) {
    LdiCell cell;
    cell.key = key;
    cell.pixels = static_cast<std::uint32_t>(content.count());
    cell.blocks_of_kind = content.blocks_of_kind();
    tree.cells.push_back(cell);
  }
  std::sort(tree.cells.begin(), tree.cells.end(), [](LdiCell const& a, LdiCell const& b) {
    return a.key.level != b.key.level ? a.key.level > b.key.level : a.key.index < b.key.index;
  });
  std::uint64_t size = 0;
  for (LdiCell& cell : tree.cells) {
    cell.offset = size;
    size += LdiTree::content_bytes(cell);
  }
  auto const bytes = std::make_shared<std::vector<std::byte>>(size + kLdiPadding);
  for (LdiCell& cell : tree.cells) {
    LdiContent& content = contents.at(cell.key);
    std::size_t const length = LdiTree::content_bytes(cell);
    std::copy_n(content.bytes().begin(), length, bytes->data() + cell.offset);
    cell.hash = XXH3_64bits(bytes->data() + cell.offset, length);
    content = {};
  }
  tree.content = {bytes->data(), size};
  tree.owner = bytes;
  link_cells(tree.cells, tree.roots);
  if (!tree.cells.empty()) tree.place_object();
  return tree;
}

}  // namespace scanview
