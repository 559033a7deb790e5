#include "viewer/layered/ldi_filter.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "base/parallel.h"
#include "viewer/layered/ldi_content.h"

namespace scanview {
namespace {

using Contents = std::unordered_map<LdiCellKey, LdiContent, LdiCellKeyHash>;

constexpr double kOwnFull = kLdiFullWeight, kFilteredFull = 255 * 64;
/// Pixels that cover less, of 255, are left out.
constexpr int kLeastCover = 3;

/// One layer of a grid point: neighbouring depth bins that are one surface.
struct Layer {
  double weight = 0, depth = 0, red = 0, green = 0, blue = 0, slope_x = 0, slope_y = 0;  // sums
  double at() const { return depth / weight; }
  void add(LdiSum const& sum, int bin_steps) {
    double const w = sum.weight;
    weight += w;
    depth += bin_steps * (w * sum.bin + (sum.depth + 0.5 * w) / 256);
    red += double(sum.red);
    green += double(sum.green);
    blue += double(sum.blue);
    slope_x += double(sum.slope_x) - 128 * w;
    slope_y += double(sum.slope_y) - 128 * w;
  }
  /// Its sums as if it had this weight.
  Layer scaled(double to) const {
    double const f = to / weight;
    return {to, depth * f, red * f, green * f, blue * f, slope_x * f, slope_y * f};
  }
  Layer operator+(Layer const& o) const {
    return {weight + o.weight, depth + o.depth,     red + o.red,        green + o.green,
            blue + o.blue,     slope_x + o.slope_x, slope_y + o.slope_y};
  }
};

/// Near to far.
void layers_of(LdiSums const* sums, int face, int x, int y, double merge, std::vector<Layer>& layers) {
  layers.clear();
  if (sums == nullptr) return;
  for (std::uint32_t k = sums->first(face, x, y); k != 0; k = (*sums)[k].next) {
    Layer one;
    one.add((*sums)[k], sums->bin_steps());
    if (!layers.empty() && one.at() - layers.back().at() < merge) {
      layers.back() = layers.back() + one;
    } else {
      layers.push_back(one);
    }
  }
}

LdiContent::Pixel pixel_of(Layer const& layer, double cover, int face, int x, int y, LdiKind kind, int resolution) {
  LdiContent::Pixel pixel;
  pixel.face = static_cast<std::uint8_t>(face);
  pixel.kind = kind;
  pixel.x = static_cast<std::uint8_t>(x);
  pixel.y = static_cast<std::uint8_t>(y);
  double const depth = std::clamp(layer.at() * 65536 / resolution, 0.0, 65535.0);
  pixel.depth = static_cast<std::uint16_t>(depth);
  auto const root = [&](double sum) {
    return static_cast<std::uint32_t>(std::clamp(std::lround(std::sqrt(sum / layer.weight)), 0L, 255L));
  };
  std::uint32_t const alpha = static_cast<std::uint32_t>(std::clamp(std::lround(255 * cover), 1L, 255L));
  pixel.color = root(layer.red) | root(layer.green) << 8 | root(layer.blue) << 16 | alpha << 24;
  auto const slope = [&](double sum) {
    return static_cast<std::int8_t>(std::clamp(std::lround(sum / layer.weight), -127L, 127L));
  };
  pixel.slope_x = slope(layer.slope_x);
  pixel.slope_y = slope(layer.slope_y);
  return pixel;
}

/// The cells above one whose images see the same places, nearest first.
using Ancestors = std::vector<LdiSums const*>;

/// What becomes of the layers that were splatted to a cell and of those that come from its children.
class Merger {
 public:
  Merger(LdiCellKey const& key, LdiSums const* own, LdiSums const* filtered, Ancestors const& above,
         LdiOptions const& options)
      : key_(key), own_(own), filtered_(filtered), above_(above), options_(options), n_(options.resolution) {}

  LdiContent merge() {
    for (int face = 0; face < kLdiFaces; ++face) {
      if (!has(own_, face) && !has(own_, face + kLdiFaces) && !has(filtered_, face)) continue;
      for (int y = 0; y < n_; ++y)
        for (int x = 0; x < n_; ++x) merge_place(face, x, y);
    }
    return LdiContent(std::move(pixels_), n_);
  }

 private:
  static bool has(LdiSums const* sums, int face) { return sums != nullptr && sums->has_face(face); }
  double merge_steps(int level) const { return options_.merge_distance(level) / ldi_step(level); }

  void merge_place(int face, int x, int y) {
    constexpr double kRounding = 1.0 / 128;  // of coverages in 8 bits
    double const within = merge_steps(key_.level);
    layers_of(own_, face, x, y, within, here_);
    layers_of(own_, face + kLdiFaces, x, y, within, rims_);
    layers_of(filtered_, face, x, y, within, below_);
    for (Layer const& rim : rims_)
      if (!is_seen_better(rim, face, x, y)) take_in(rim, within);
    for (Layer const& layer : here_) {
      double const cover = std::min(1.0, layer.weight / kOwnFull);
      Layer* const nearest = find(below_, layer.at(), within);
      double const other_cover = nearest != nullptr ? std::min(1.0, nearest->weight / kFilteredFull) : 0;
      if (nearest != nullptr && other_cover + kRounding >= options_.covered * cover) {
        // "The merged pixel is also considered filtered" (Chang 1998, §3.1). What comes from below counts four times:
        // of finer images.
        double const share = 4 * other_cover / (4 * other_cover + cover);
        double const weight = std::max(cover, other_cover) * kFilteredFull;
        *nearest = nearest->scaled(share * weight) + layer.scaled((1 - share) * weight);
      } else if (255 * cover >= kLeastCover) {
        LdiKind const kind = nearest != nullptr ? LdiKind::patch : LdiKind::unfiltered;
        pixels_.push_back(pixel_of(layer, cover, face, x, y, kind, n_));
      }
    }
    for (Layer const& layer : below_) {
      double const cover = std::min(1.0, layer.weight / kFilteredFull);
      if (255 * cover >= kLeastCover) pixels_.push_back(pixel_of(layer, cover, face, x, y, LdiKind::filtered, n_));
    }
  }

  static Layer* find(std::vector<Layer>& layers, double at, double within) {
    Layer* nearest = nullptr;
    for (Layer& other : layers)
      if (std::abs(other.at() - at) < within &&
          (nearest == nullptr || std::abs(other.at() - at) < std::abs(nearest->at() - at)))
        nearest = &other;
    return nearest;
  }

  /// A rim becomes a part of the layer that it is near to, or one of its own.
  void take_in(Layer const& rim, double within) {
    Layer* const nearest = find(here_, rim.at(), within);
    if (nearest == nullptr) {
      here_.push_back(rim);
    } else {
      *nearest = *nearest + rim;
    }
  }

  double cover_near(LdiSums const* sums, int face, int x, int y, double at, double within, double full) {
    if (!has(sums, face)) return 0;
    double cover = 0;
    for (std::uint32_t k = sums->first(face, x, y); k != 0; k = (*sums)[k].next)
      if (std::abs(((*sums)[k].bin + 0.5) * sums->bin_steps() - at) < within + 0.5 * sums->bin_steps())
        cover += (*sums)[k].weight;
    return cover / full;
  }

  /// Whether the surface goes on at both sides of a place: what looks like a rim there is noise, and coarser levels,
  /// which the finer ones around cover, would not fill the hole.
  bool is_within(int face, int x, int y, double at, double within) {
    constexpr double kCovered = 0.5;
    auto const is_covered = [&](int i, int j) {
      return i < 0 || j < 0 || i >= n_ || j >= n_ || cover_near(own_, face, i, j, at, within, kOwnFull) >= kCovered;
    };
    return (is_covered(x - 1, y) && is_covered(x + 1, y)) || (is_covered(x, y - 1) && is_covered(x, y + 1));
  }

  /// Of the rims of surfaces, whose colours may be mixtures and which reach beyond the surface, only those count that
  /// show what no other pixel shows: neither of this level, nor a finer one around, nor of the next two coarser levels.
  bool is_seen_better(Layer const& rim, int face, int x, int y) {
    constexpr double kCovered = 0.75, kNear = 0.25;
    double const within = merge_steps(key_.level);
    if (cover_near(own_, face, x, y, rim.at(), within, kOwnFull) >= kCovered) return true;
    for (int j = std::max(0, y - 1); j <= std::min(n_ - 1, y + 1); ++j)
      for (int i = std::max(0, x - 1); i <= std::min(n_ - 1, x + 1); ++i)
        if (cover_near(filtered_, face, i, j, rim.at(), within + 1, kFilteredFull) >= kNear) return true;
    if (is_within(face, x, y, rim.at(), within)) return false;
    std::size_t const axis = static_cast<std::size_t>(face / 2), b = (axis + 1) % 3, c = (axis + 2) % 3;
    double place_x = x + 0.5, place_y = y + 0.5, depth = rim.at();
    LdiCellKey key = key_;
    for (LdiSums const* const above : above_) {
      auto const up = [&](double value, std::size_t k) { return (value + double(key.index[k] & 1) * n_) / 2; };
      place_x = up(place_x, b);
      place_y = up(place_y, c);
      depth = up(depth, axis);
      key = key.parent();
      if (cover_near(above, face, static_cast<int>(place_x), static_cast<int>(place_y), depth, merge_steps(key.level),
                     kOwnFull) >= kCovered)
        return true;
    }
    return false;
  }

  LdiCellKey key_;
  LdiSums const *own_, *filtered_;
  Ancestors const& above_;
  LdiOptions const& options_;
  int n_;
  std::vector<LdiContent::Pixel> pixels_;
  std::vector<Layer> here_, rims_, below_;
};

/// Children's pixels as sums of their parent: also of its neighbours' children along the border, whose kernels reach
/// into it.
class Gatherer {
 public:
  Gatherer(LdiCellKey const& parent, int resolution) : parent_(parent), n_(resolution), sums_(resolution) {}

  LdiSums const& gather(Contents const& contents) {
    for (int z = -1; z <= 2; ++z)
      for (int y = -1; y <= 2; ++y)
        for (int x = -1; x <= 2; ++x) {
          auto const at = [&](int k, int offset) { return 2 * parent_.index[static_cast<std::size_t>(k)] + offset; };
          LdiCellKey const child{parent_.level - 1, {at(0, x), at(1, y), at(2, z)}};
          auto const it = contents.find(child);
          if (it == contents.end()) continue;
          int const offset[3] = {x, y, z};
          take(it->second, offset);
        }
    return sums_;
  }

 private:
  void take(LdiContent const& content, int const (&offset)[3]) {
    LdiPixels const pixels = content.pixels();
    for (LdiBlock const& block : content.blocks()) {
      int const axis = block.face / 2;
      int const shift[3] = {offset[(axis + 1) % 3] * n_, offset[(axis + 2) % 3] * n_, offset[axis] * n_};
      bool outside = false;
      for (int k = 0; k < 3; ++k)
        outside = outside || block.high[k] + shift[k] < -2 || block.low[k] + shift[k] > 2 * n_ + 1;
      if (outside) continue;
      for (std::uint32_t i = block.first; i < block.first + block.count; ++i) take(pixels, i, block.face, shift);
    }
  }

  void take(LdiPixels const& pixels, std::uint32_t i, int face, int const (&shift)[3]) {
    int const x = pixels.x[i] + shift[0], y = pixels.y[i] + shift[1];
    float const depth = (float(pixels.depth[i]) * float(n_) / 65536 + float(shift[2])) / 2;
    std::uint32_t const color = pixels.color[i], alpha = color >> 24;
    auto const square = [](std::uint32_t root) { return std::uint64_t{root & 255} * (root & 255); };
    float const slope_x = float(pixels.slope_x[i]) / kLdiSlope, slope_y = float(pixels.slope_y[i]) / kLdiSlope;
    // An even one lies a quarter of a step before its parent's grid point, an odd one behind it.
    int const first_x = (x - 1) >> 1, first_y = (y - 1) >> 1;
    for (int j = 0; j < 2; ++j)
      for (int k = 0; k < 2; ++k) {
        int const to_x = first_x + k, to_y = first_y + j;
        if (to_x < 0 || to_y < 0 || to_x >= n_ || to_y >= n_) continue;
        float const dx = float(to_x) + 0.5F - (float(x) + 0.5F) / 2, dy = float(to_y) + 0.5F - (float(y) + 0.5F) / 2;
        float const at = depth + slope_x * dx + slope_y * dy;
        if (!(at >= 0 && at < float(n_))) continue;
        std::uint32_t const bin = static_cast<std::uint32_t>(at);
        std::uint32_t const weight = alpha * (std::abs(dx) < 0.5F ? 3 : 1) * (std::abs(dy) < 0.5F ? 3 : 1);
        LdiSum& sum = sums_.at(face, to_x, to_y, bin);
        sum.weight += weight;
        sum.depth += weight * static_cast<std::uint32_t>((at - float(bin)) * 256);
        sum.red += weight * square(color);
        sum.green += weight * square(color >> 8);
        sum.blue += weight * square(color >> 16);
        sum.slope_x += weight * static_cast<std::uint32_t>(pixels.slope_x[i] + 128);
        sum.slope_y += weight * static_cast<std::uint32_t>(pixels.slope_y[i] + 128);
      }
  }

  LdiCellKey parent_;
  int n_;
  LdiSums sums_;
};

bool has_children(LdiCellKey const& parent, Contents const& contents) {
  for (std::int64_t which = 0; which < 8; ++which) {
    LdiCellKey child{parent.level - 1, {}};
    for (std::size_t k = 0; k < 3; ++k) child.index[k] = 2 * parent.index[k] + (which >> k & 1);
    if (contents.contains(child)) return true;
  }
  return false;
}

/// The level at which all cells lie within two along each axis: the root's children.
int top_level(LdiSumCells const& sums) {
  int level = std::numeric_limits<int>::min();
  for (auto const& [key, cell] : sums) level = std::max(level, key.level);
  std::array<std::int64_t, 3> low, high;
  low.fill(std::numeric_limits<std::int64_t>::max());
  high.fill(std::numeric_limits<std::int64_t>::min());
  for (auto const& [key, cell] : sums)
    for (std::size_t k = 0; k < 3; ++k) {
      std::int64_t const index = key.index[k] >> std::min(level - key.level, 62);
      low[k] = std::min(low[k], index);
      high[k] = std::max(high[k], index);
    }
  auto const spans = [&] {
    for (std::size_t k = 0; k < 3; ++k)
      if (high[k] - low[k] > 1) return true;
    return false;
  };
  for (; spans(); ++level)
    for (std::size_t k = 0; k < 3; ++k) low[k] >>= 1, high[k] >>= 1;
  return level;
}

}  // namespace

LdiTree filter_upwards(LdiSumCells const& sums, LdiOptions const& options, Context& context) {
  std::map<int, std::vector<LdiCellKey>> levels;
  for (auto const& [key, cell] : sums) levels[key.level].push_back(key);
  int const top = top_level(sums);
  Contents contents;
  std::size_t done = 0;
  for (int level = levels.begin()->first; level <= top; ++level) {
    std::vector<LdiCellKey>& keys = levels[level];
    std::sort(keys.begin(), keys.end());
    keys.erase(std::unique(keys.begin(), keys.end()), keys.end());
    std::vector<LdiContent> made(keys.size());
    for_each_index(context, keys.size(), [&](std::size_t i) {
      auto const find = [&](LdiCellKey const& key) {
        auto const it = sums.find(key);
        return it != sums.end() ? it->second.get() : nullptr;
      };
      Ancestors above;
      LdiCellKey key = keys[i];
      for (int k = 0; k < 2; ++k) {
        key = key.parent();
        above.push_back(find(key));
      }
      Gatherer gatherer(keys[i], options.resolution);
      LdiSums const& filtered = gatherer.gather(contents);
      made[i] = Merger(keys[i], find(keys[i]), &filtered, above, options).merge();
    });
    std::vector<LdiCellKey> parents;
    for (std::size_t i = 0; i < keys.size(); ++i) {
      // A cell without pixels still is the way to its children: what covers too little to be seen from afar.
      if (made[i].count() == 0 && !has_children(keys[i], contents)) continue;
      contents.emplace(keys[i], std::move(made[i]));
      parents.push_back(keys[i].parent());
    }
    if (level < top) {
      auto& next = levels[level + 1];
      next.insert(next.end(), parents.begin(), parents.end());
    }
    context.progress("filter", ++done, static_cast<std::size_t>(top - levels.begin()->first + 1));
  }
  return tree_of(std::move(contents), options);
}

}  // namespace scanview
