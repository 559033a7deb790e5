#include "viewer/layered/ldi_builder.h"

#include <algorithm>
#include <atomic>
#include <cmath>

#include "base/error.h"
#include "base/parallel.h"
#include "viewer/layered/ldi_filter.h"
#include "viewer/layered/ldi_key_order.h"

namespace scanview {
namespace {

constexpr double kFull = kLdiFullWeight;
/// A stamp of a surface that is seen from a grazing angle reaches no further than so many grid points.
constexpr float kFarthest = 48;
/// More than a tangent plane, of slopes up to 1, rises over that reach.
constexpr std::int32_t kDeep = 128;

std::int64_t floor_to_int(double value) { return static_cast<std::int64_t>(std::floor(value)); }

}  // namespace

/// A stamp above one cell, in grid steps from its corner along the face's axes.
struct LdiBuilder::Landing {
  LdiCellKey cell;
  float x, y;
  /// Depth is bin + (depth − kDeep): so that cells above each other agree to the bit on whose bin it is in.
  std::int32_t bin;
  float depth;
  /// From grid points to stamps: (a, b) = inverse (X − x, Y − y), in which the kernel is (1 − |a|)(1 − |b|); its reach
  /// along x and y.
  float a_x, a_y, b_x, b_y, reach_x, reach_y;
  float slope_x, slope_y;
  float share;  ///< S / P of equations 3a and 3b where stamps are smaller than grid steps
  std::uint16_t red, green, blue;
  std::uint8_t face;  ///< LdiSums
};

LdiBuilder::LdiBuilder(LdiOptions const& options) : options_(options) { options_.validate(); }

void LdiBuilder::land(Stamp const& stamp, std::vector<Landing>& landings) const {
  int level = static_cast<int>(std::floor(std::log2(double(stamp.size) * options_.coarseness)));
  bool const limited = options_.step_limit() > 0 && ldi_step(level) < options_.step_limit();
  if (limited) level = static_cast<int>(std::lround(std::log2(options_.step_limit())));
  double const step = ldi_step(level);
  bool const oriented = options_.normals == LdiOptions::Normals::measured;
  int axis = 0;
  if (oriented) {
    for (int k = 1; k < 3; ++k)
      if (std::abs(stamp.normal[k]) > std::abs(stamp.normal[axis])) axis = k;
  }
  int const b = (axis + 1) % 3, c = (axis + 2) % 3;
  Landing landing;
  landing.face =
      static_cast<std::uint8_t>(2 * axis + (oriented && stamp.normal[axis] > 0 ? 1 : 0) + (stamp.rim ? kLdiFaces : 0));
  landing.red = stamp.red;
  landing.green = stamp.green;
  landing.blue = stamp.blue;
  landing.slope_x = oriented ? -stamp.normal[b] / stamp.normal[axis] : 0;
  landing.slope_y = oriented ? -stamp.normal[c] / stamp.normal[axis] : 0;
  // As doubles: a float may have no room for the inverse of its own size.
  auto const in_steps = [&](float length) { return static_cast<float>(double(length) / step); };
  float const size = in_steps(stamp.size);
  float u_x = in_steps(stamp.along_u[b]), u_y = in_steps(stamp.along_u[c]);
  float v_x = in_steps(stamp.along_v[b]), v_y = in_steps(stamp.along_v[c]);
  if (!oriented) u_x = v_y = size, u_y = v_x = 0;
  float determinant = u_x * v_y - u_y * v_x;
  landing.share = 1;
  // Smaller than the grid (a limited level, or coarse grids): the bilinear kernel of the grid, equations 3a, 3b below.
  if (limited || options_.coarseness > 1 || !(std::abs(determinant) > 0.05F)) {
    float const stamp_x = std::max(std::abs(u_x), std::abs(v_x)), stamp_y = std::max(std::abs(u_y), std::abs(v_y));
    u_x = std::max(stamp_x, 1.0F);
    v_y = std::max(stamp_y, 1.0F);
    u_y = v_x = 0;
    landing.share = std::min(1.0F, std::abs(determinant) / (u_x * v_y));
    determinant = u_x * v_y;
  }
  landing.a_x = v_y / determinant;
  landing.a_y = -v_x / determinant;
  landing.b_x = -u_y / determinant;
  landing.b_y = u_x / determinant;
  landing.reach_x = std::min(std::abs(u_x) + std::abs(v_x), kFarthest);
  landing.reach_y = std::min(std::abs(u_y) + std::abs(v_y), kFarthest);

  // Grid points are in the middle of steps.
  Eigen::Vector3d const at = (stamp.center - ldi_origin()) / step;
  if (!(at.cwiseAbs().maxCoeff() <= double(kLdiFarthestGridPoint)))
    throw Error(ErrorCode::bad_input, {},
                "pixels are too small for how far they are from the origin: move the scene there, or give a smallest "
                "feature");
  double const x = at[b] - 0.5, y = at[c] - 0.5, depth = at[axis];
  float rise = std::abs(landing.slope_x) * landing.reach_x + std::abs(landing.slope_y) * landing.reach_y;
  constexpr double kRounding = 1e-3;
  if (rise > 0) rise += float(kRounding);
  std::int64_t const bin = floor_to_int(depth);
  landing.depth = std::min(static_cast<float>(depth - double(bin)), 1 - 0x1p-16F) + float(kDeep);
  auto const low = [&](double value, float reach) {
    return floor_to_int(value - double(reach)) + 1;  // the first grid point with a weight, or one before it
  };
  std::int64_t const n = options_.resolution;
  auto const cell_of = [&](std::int64_t grid) { return (grid >= 0 ? grid : grid - n + 1) / n; };
  std::int64_t const first[3] = {cell_of(low(x, landing.reach_x)), cell_of(low(y, landing.reach_y)),
                                 cell_of(floor_to_int(depth - double(rise)))};
  std::int64_t const last[3] = {cell_of(floor_to_int(x + double(landing.reach_x))),
                                cell_of(floor_to_int(y + double(landing.reach_y))),
                                cell_of(floor_to_int(depth + double(rise)))};
  landing.cell.level = level;
  // How far the plane rises from the middle to the grid points of a row of cells, at least and at most.
  auto const rises = [&](std::int64_t cell, double value, float reach, float slope) {
    double const most = double(reach), at_low = std::clamp(double(cell * n) - value, -most, most),
                 at_high = std::clamp(double(cell * n + n - 1) - value, -most, most);
    return std::minmax({double(slope) * at_low, double(slope) * at_high});
  };
  for (std::int64_t j = first[1]; j <= last[1]; ++j)
    for (std::int64_t i = first[0]; i <= last[0]; ++i) {
      std::int64_t low_z = first[2], high_z = last[2];
      if (low_z < high_z) {
        auto const [low_x, high_x] = rises(i, x, landing.reach_x, landing.slope_x);
        auto const [low_y, high_y] = rises(j, y, landing.reach_y, landing.slope_y);
        low_z = cell_of(floor_to_int(depth + low_x + low_y - kRounding));
        high_z = cell_of(floor_to_int(depth + high_x + high_y + kRounding));
      }
      for (std::int64_t z = low_z; z <= high_z; ++z) {
        landing.cell.index[static_cast<std::size_t>(axis)] = z;
        landing.cell.index[static_cast<std::size_t>(b)] = i;
        landing.cell.index[static_cast<std::size_t>(c)] = j;
        landing.x = static_cast<float>(x - double(i * n));
        landing.y = static_cast<float>(y - double(j * n));
        landing.bin = static_cast<std::int32_t>(bin - z * n);
        landings.push_back(landing);
      }
    }
}

namespace {

template <typename Landing>
bool splat(Landing const& landing, LdiSums& sums) {
  int const n = sums.resolution();
  int const x0 = std::max(0, static_cast<int>(std::floor(landing.x - landing.reach_x)) + 1),
            y0 = std::max(0, static_cast<int>(std::floor(landing.y - landing.reach_y)) + 1);
  int const x1 = std::min(n - 1, static_cast<int>(std::floor(landing.x + landing.reach_x))),
            y1 = std::min(n - 1, static_cast<int>(std::floor(landing.y + landing.reach_y)));
  auto const biased = [](float slope) { return static_cast<std::uint32_t>(std::lround(slope * kLdiSlope) + 128); };
  std::uint32_t const slope_x = biased(landing.slope_x), slope_y = biased(landing.slope_y);
  for (int y = y0; y <= y1; ++y)
    for (int x = x0; x <= x1; ++x) {
      float const dx = float(x) - landing.x, dy = float(y) - landing.y;
      float const a = 1 - std::abs(landing.a_x * dx + landing.a_y * dy),
                  b = 1 - std::abs(landing.b_x * dx + landing.b_y * dy);
      if (!(a > 0 && b > 0)) continue;
      float const exact = a * b * landing.share * float(kFull);
      std::uint32_t const weight =
          std::max(landing.share < 1 ? 1U : 0U, static_cast<std::uint32_t>(std::lround(exact)));
      if (weight == 0) continue;
      float const depth = landing.depth + landing.slope_x * dx + landing.slope_y * dy;
      std::int32_t const whole = static_cast<std::int32_t>(depth), in_cell = landing.bin + whole - kDeep;
      if (in_cell < 0 || in_cell >= n) continue;
      int const shift = sums.bin_shift(), in_bin = in_cell & (sums.bin_steps() - 1);
      LdiSum& sum = sums.at(landing.face, x, y, static_cast<std::uint32_t>(in_cell >> shift));
      if (sum.weight > LdiSums::kMostWeight - weight) return false;
      sum.weight += weight;
      sum.depth += weight * (static_cast<std::uint32_t>((float(in_bin) + (depth - float(whole))) * 256) >> shift);
      sum.red += std::uint64_t{weight} * landing.red;
      sum.green += std::uint64_t{weight} * landing.green;
      sum.blue += std::uint64_t{weight} * landing.blue;
      sum.slope_x += weight * slope_x;
      sum.slope_y += weight * slope_y;
    }
  return true;
}

}  // namespace

void LdiBuilder::add_batch(std::vector<View> const& views, std::size_t begin, std::size_t end, Context& context) {
  StampOptions stamp_options;
  stamp_options.normals = options_.normals == LdiOptions::Normals::measured ? StampOptions::Normals::measured
                                                                            : StampOptions::Normals::facing;
  // Bands of rows land on their own; the order in which cells then take them does not matter.
  constexpr int kBand = 64;
  struct Band {
    std::size_t reader;
    int top, bottom;
    std::vector<Landing> landings;
    std::vector<std::uint32_t> order;                         // by cell
    std::vector<std::pair<LdiCellKey, std::uint32_t>> cells;  // and where in `order` each begins
    std::size_t stamps = 0;
  };
  std::vector<std::unique_ptr<StampReader>> readers(end - begin);
  for_each_index(context, readers.size(),
                 [&](std::size_t i) { readers[i] = std::make_unique<StampReader>(views[begin + i], stamp_options); });
  std::vector<Band> bands;
  for (std::size_t i = 0; i < readers.size(); ++i) {
    int const height = views[begin + i].image.depth.rows;
    for (int top = 0; top < height; top += kBand)
      bands.push_back({i, top, std::min(top + kBand, height), {}, {}, {}, 0});
  }
  for_each_index(context, bands.size(), [&](std::size_t k) {
    Band& band = bands[k];
    std::vector<Stamp> stamps;
    for (int y = band.top; y < band.bottom; ++y) {
      stamps.clear();
      readers[band.reader]->read_row(y, stamps);
      band.stamps += stamps.size();
      for (Stamp const& stamp : stamps) land(stamp, band.landings);
    }
    std::unordered_map<LdiCellKey, std::uint32_t, LdiCellKeyHash> numbers;
    std::vector<std::uint32_t> cell_of(band.landings.size());
    std::vector<LdiCellKey> keys;
    std::vector<std::uint32_t> counts;
    std::uint32_t number = 0;
    for (std::size_t i = 0; i < band.landings.size(); ++i) {
      LdiCellKey const& key = band.landings[i].cell;
      if (i == 0 || key != band.landings[i - 1].cell) {
        auto const [it, is_new] = numbers.try_emplace(key, static_cast<std::uint32_t>(keys.size()));
        if (is_new) keys.push_back(key), counts.push_back(0);
        number = it->second;
      }
      cell_of[i] = number;
      ++counts[number];
    }
    std::uint32_t at = 0;
    for (std::size_t c = 0; c < keys.size(); ++c) {
      band.cells.emplace_back(keys[c], at);
      at += counts[c];
      counts[c] = at - counts[c];
    }
    band.order.resize(band.landings.size());
    for (std::size_t i = 0; i < band.landings.size(); ++i)
      band.order[counts[cell_of[i]]++] = static_cast<std::uint32_t>(i);
  });
  struct Part {
    Band const* band;
    std::uint32_t begin, end;
  };
  std::unordered_map<LdiCellKey, std::vector<Part>, LdiCellKeyHash> parts;
  for (Band const& band : bands) {
    input_pixels_ += band.stamps;
    for (std::size_t c = 0; c < band.cells.size(); ++c) {
      std::uint32_t const last =
          c + 1 < band.cells.size() ? band.cells[c + 1].second : static_cast<std::uint32_t>(band.order.size());
      parts[band.cells[c].first].push_back({&band, band.cells[c].second, last});
    }
  }
  std::vector<std::pair<LdiSums*, std::vector<Part> const*>> jobs;
  for (auto const& [key, list] : parts) {
    auto& sums = cells_[key];
    if (!sums) sums = std::make_unique<LdiSums>(options_.resolution, options_.bin_shift(key.level));
    jobs.emplace_back(sums.get(), &list);
  }
  // Long ones first, so that none is left when the others are done.
  auto const length = [](std::vector<Part> const& list) {
    std::size_t sum = 0;
    for (Part const& part : list) sum += part.end - part.begin;
    return sum;
  };
  std::vector<std::pair<std::size_t, std::size_t>> by_length;
  for (std::size_t i = 0; i < jobs.size(); ++i) by_length.emplace_back(length(*jobs[i].second), i);
  std::sort(by_length.rbegin(), by_length.rend());
  std::atomic<bool> overflow = false;
  for_each_index(context, jobs.size(), [&](std::size_t i) {
    auto const& [sums, list] = jobs[by_length[i].second];
    for (Part const& part : *list)
      for (std::uint32_t k = part.begin; k < part.end; ++k)
        if (!splat(part.band->landings[part.band->order[k]], *sums)) overflow = true;
  });
  // Tangent planes reach fewer cells than the boxes about stamps.
  for (auto const& [key, list] : parts)
    if (auto const it = cells_.find(key); it->second->count() == 0) cells_.erase(it);
  if (overflow) throw Error(ErrorCode::bad_input, {}, "more pixels fall on one place of the tree than can be summed");
}

void LdiBuilder::add(std::vector<View> const& views, Context& context) {
  for (View const& view : views) {
    if (!view.object_from_camera)
      throw Error(ErrorCode::bad_input, {}, "view " + view.name + " has no pose: register the set first");
    if (view.image.depth.empty() || view.image.color.empty())
      throw Error(ErrorCode::bad_input, {}, "view " + view.name + " has no image");
  }
  constexpr std::size_t kBatchPixels = 1 << 21;
  for (std::size_t begin = 0; begin < views.size();) {
    std::size_t end = begin, pixels = 0;
    while (end < views.size() && (end == begin || pixels < kBatchPixels)) pixels += views[end++].image.depth.total();
    context.check_cancelled();
    add_batch(views, begin, end, context);
    begin = end;
    context.progress("splat", begin, views.size());
  }
  for (View const& view : views) {
    constexpr std::uint64_t kColorAndDepth = 3 + 4;
    input_bytes_ += kColorAndDepth * view.image.depth.total();
    View kept;
    kept.name = view.name;
    kept.object_from_camera = view.object_from_camera;
    kept.gain = view.gain;
    kept.image.camera = view.image.camera;
    views_.push_back(std::move(kept));
  }
}

void LdiBuilder::resume(LdiTree const& tree, LdiSumCells&& sums) {
  options_ = tree.options;
  cells_ = std::move(sums);
  views_ = tree.views;
  input_pixels_ = tree.input_pixels;
  input_bytes_ = tree.input_bytes;
}

LdiTree LdiBuilder::build(Unit unit, Context& context) const {
  if (cells_.empty()) throw Error(ErrorCode::bad_input, {}, "no pixel of the reference images has a depth");
  LdiTree tree = filter_upwards(cells_, options_, context);
  if (tree.cells.empty())
    throw Error(ErrorCode::bad_input, {},
                "the reference images' pixels cover next to nothing of the grid: give a smaller smallest feature");
  tree.unit = unit;
  tree.views = views_;
  std::sort(tree.views.begin(), tree.views.end(), [](View const& a, View const& b) {
    auto const flat = [](View const& view) {
      Eigen::Matrix4d const m = view.object_from_camera->matrix();
      Camera const& camera = view.image.camera;
      std::vector<double> all(m.data(), m.data() + m.size());
      all.insert(all.end(),
                 {view.gain[0], view.gain[1], view.gain[2], double(camera.is_perspective()), double(camera.width()),
                  double(camera.height()), camera.fx(), camera.fy(), camera.cx(), camera.cy()});
      return all;
    };
    return a.name != b.name ? a.name < b.name : flat(a) < flat(b);
  });
  tree.input_pixels = input_pixels_;
  tree.input_bytes = input_bytes_;
  return tree;
}

}  // namespace scanview
