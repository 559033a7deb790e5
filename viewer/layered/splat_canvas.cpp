#include "viewer/layered/splat_canvas.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <numeric>
#include <optional>

#include "base/error.h"
#include "base/parallel.h"
#include "base/srgb.h"
#include "viewer/layered/ldi_traversal.h"

namespace scanview {
namespace {

constexpr float kLeast = 0.6F;  // pixels that a splat reaches at least: wider is more blurred, less lets noise through
constexpr float kWidest = 48;   // pixels that a splat reaches: what is nearer is out of focus anyway

}  // namespace

/// A cell as the camera sees it.
struct SplatCanvas::DrawnCell {
  SplatTransform transforms[kLdiFaces];
  LdiPixels pixels;
};

struct SplatCanvas::DrawnBlock {
  std::uint32_t cell, first;
  std::uint16_t count;
  std::uint8_t face;
  bool fills;
  float nearest;                 // depth
  int left, right, top, bottom;  // pixels that it may reach
};

void SplatCanvas::begin(Camera const& camera, Eigen::Isometry3d const& object_from_camera) {
  camera_ = camera;
  camera_from_object_ = object_from_camera.inverse();
  std::size_t const size = stride() * static_cast<std::size_t>(camera.height());
  if (size > capacity_) {
    // Layers of a pixel apart from one another, too.
    layer_size_ = size + 32;
    layers_ = std::make_unique_for_overwrite<OutputLayer[]>(kOutputLayers * layer_size_);
    capacity_ = size;
  }
  counts_.resize(size);
  touched_.assign(bands(), {});
}

OutputArea SplatCanvas::area(std::size_t band, cv::Mat1b const& stencil) const {
  int const top = static_cast<int>(band) * kBand;
  std::size_t const first = static_cast<std::size_t>(top) * stride() + 1;
  OutputArea area;
  for (int k = 0; k < kOutputLayers; ++k)
    area.layers[k] = layers_.get() + static_cast<std::size_t>(k) * layer_size_ + first;
  area.counts = const_cast<std::uint8_t*>(counts_.data()) + first;
  area.stencil = stencil.empty() ? nullptr : stencil.ptr(top);
  area.stride = static_cast<int>(stride());
  area.left = 0;
  area.right = camera_.width();
  area.top = top;
  area.bottom = std::min(top + kBand, camera_.height());
  area.first_x = area.left, area.end_x = area.right;
  area.first_y = area.top, area.end_y = area.bottom;
  return area;
}

Eigen::Matrix<double, 3, 4> screen_from_grid(LdiTree const& tree, LdiCell const& cell, int face, Camera const& camera,
                                             Eigen::Isometry3d const& camera_from_object) {
  int const axis = face / 2;
  double const step = ldi_step(cell.key.level);
  Eigen::Matrix<double, 3, 4> placed;
  placed.col(0) = step * camera_from_object.linear().col((axis + 1) % 3);
  placed.col(1) = step * camera_from_object.linear().col((axis + 2) % 3);
  placed.col(2) = step * camera_from_object.linear().col(axis);
  placed.col(3) = camera_from_object * ldi_corner(cell.key, tree.options.resolution);
  Eigen::Matrix<double, 3, 4> rows;
  rows.row(0) = camera.fx() * placed.row(0);
  rows.row(1) = camera.fy() * placed.row(1);
  rows.row(2) = placed.row(2);
  if (camera.is_perspective()) {
    rows.row(0) += camera.cx() * placed.row(2);
    rows.row(1) += camera.cy() * placed.row(2);
  } else {
    rows(0, 3) += camera.cx();
    rows(1, 3) += camera.cy();
  }
  return rows;
}

namespace {

SplatTransform transform_of(LdiTree const& tree, LdiCell const& cell, int face, Camera const& camera,
                            Eigen::Isometry3d const& camera_from_object, double near) {
  Eigen::Matrix<double, 3, 4> const rows = screen_from_grid(tree, cell, face, camera, camera_from_object);
  bool const perspective = camera.is_perspective();
  SplatTransform transform;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 4; ++k) transform.rows[i][k] = static_cast<float>(rows(i, k));
  transform.depth_scale = float(tree.options.resolution) / 65536;
  // The grid's axes and the face's own make a right-handed frame: on the screen (y down) it turns the positive way
  // where the axis points away from the camera.
  bool const oriented = tree.options.normals == LdiOptions::Normals::measured;
  transform.facing = !oriented ? 0 : face % 2 == 0 ? 1 : -1;
  transform.step = static_cast<float>(ldi_step(cell.key.level) * std::sqrt(camera.fx() * camera.fy()));
  // Of uncertain depths normals are uncertain.
  transform.doubt = tree.options.depth_error > ldi_step(cell.key.level) ? 1 : 0;
  transform.tolerance = static_cast<float>(tree.options.merge_distance(cell.key.level));
  transform.near = static_cast<float>(near);
  // A fifth of the picture's size, as what is about as far away has where perspective is.
  transform.deepest = static_cast<float>(0.2 * std::max(camera.width() / camera.fx(), camera.height() / camera.fy()));
  transform.least = kLeast;
  transform.widest = kWidest;
  transform.perspective = perspective;
  return transform;
}

}  // namespace

namespace {

struct PixelBox {
  int left = 1 << 30, right = 0, top = 1 << 30, bottom = 0;
  void add(PixelBox const& other) {
    left = std::min(left, other.left), right = std::max(right, other.right);
    top = std::min(top, other.top), bottom = std::max(bottom, other.bottom);
  }
};

/// Where in a rectangle pixels are to be drawn on, by tiles.
class StencilTiles {
 public:
  explicit StencilTiles(cv::Mat1b const& stencil)
      : columns_((stencil.cols + kTile - 1) / kTile),
        boxes_(static_cast<std::size_t>(columns_ * ((stencil.rows + kTile - 1) / kTile))) {
    for (int y = 0; y < stencil.rows; ++y)
      for (int x = 0; x < stencil.cols; ++x)
        if (stencil(y, x) != 0) boxes_[place(x / kTile, y / kTile)].add({x, x + 1, y, y + 1});
  }
  /// Of all within it or near; empty (left ≥ right) where there are none.
  PixelBox within(int left, int right, int top, int bottom) const {
    PixelBox box;
    for (int y = top / kTile; y <= (bottom - 1) / kTile; ++y)
      for (int x = left / kTile; x <= (right - 1) / kTile; ++x) box.add(boxes_[place(x, y)]);
    return box;
  }

 private:
  static constexpr int kTile = 16;
  std::size_t place(int x, int y) const { return static_cast<std::size_t>(y * columns_ + x); }
  int columns_;
  std::vector<PixelBox> boxes_;
};

}  // namespace

std::size_t SplatCanvas::draw(LdiTree const& tree, std::vector<CellPart> const& parts, cv::Mat1b const& stencil,
                              Context& context) {
  double const near = nearest_drawn(tree);
  std::vector<DrawnCell> cells(parts.size());
  std::vector<std::vector<DrawnBlock>> blocks_of(parts.size());
  std::vector<std::string> damage(parts.size());
  int const width = camera_.width(), height = camera_.height();
  std::optional<StencilTiles> tiles;
  if (!stencil.empty()) tiles.emplace(stencil);
  constexpr std::size_t kGrain = 16;
  for_each_index(context, (parts.size() + kGrain - 1) / kGrain, [&](std::size_t grain) {
    for (std::size_t p = grain * kGrain; p < std::min(parts.size(), (grain + 1) * kGrain); ++p) {
      LdiCell const& cell = tree.cells[static_cast<std::size_t>(parts[p].cell)];
      std::size_t const kind = static_cast<std::size_t>(parts[p].kind);
      std::size_t const last =
          std::accumulate(cell.blocks_of_kind.begin(), cell.blocks_of_kind.begin() + kind + 1, std::size_t{0});
      std::size_t const first = last - cell.blocks_of_kind[kind];
      if (first >= last) continue;
      DrawnCell& drawn = cells[p];
      std::span<LdiBlock const> blocks;
      try {
        blocks = tree.blocks(cell);
      } catch (Error const& error) {
        damage[p] = error.what();
        continue;
      }
      drawn.pixels = tree.pixels(cell);
      unsigned known = 0;
      for (std::size_t k = first; k < last; ++k) {
        LdiBlock const& block = blocks[k];
        int const face = block.face;
        if ((known & 1U << face) == 0) {
          drawn.transforms[face] = transform_of(tree, cell, face, camera_, camera_from_object_, near);
          drawn.transforms[face].fills = parts[p].kind == LdiKind::patch;
          known |= 1U << face;
        }
        SplatTransform const& t = drawn.transforms[face];
        float least_u = 1e30F, most_u = -1e30F, least_v = 1e30F, most_v = -1e30F, least_z = 1e30F, most_z = -1e30F;
        for (int corner = 0; corner < 8; ++corner) {
          float const x = corner & 1 ? float(block.high[0]) + 1.0F : float(block.low[0]),
                      y = corner & 2 ? float(block.high[1]) + 1.0F : float(block.low[1]),
                      z = corner & 4 ? float(block.high[2]) + 1.0F : float(block.low[2]);
          auto const at = [&](int row) {
            return t.rows[row][0] * x + t.rows[row][1] * y + t.rows[row][2] * z + t.rows[row][3];
          };
          float const depth = at(2);
          float const per_z = t.perspective ? 1 / std::max(depth, t.near) : 1;
          float const u = at(0) * per_z, v = at(1) * per_z;
          least_u = std::min(least_u, u), most_u = std::max(most_u, u);
          least_v = std::min(least_v, v), most_v = std::max(most_v, v);
          least_z = std::min(least_z, depth), most_z = std::max(most_z, depth);
        }
        DrawnBlock one{static_cast<std::uint32_t>(p),
                       block.first,
                       block.count,
                       block.face,
                       parts[p].kind == LdiKind::patch,
                       least_z,
                       0,
                       width,
                       0,
                       height};
        if (t.perspective && most_z <= t.near) continue;
        if (!t.perspective || least_z > t.near) {
          // Splats reach about as far as two grid steps, at least a pixel.
          float const step = float(ldi_step(cell.key.level)) * float(std::max(camera_.fx(), camera_.fy())) /
                             (t.perspective ? least_z : 1.0F);
          float const reach = std::min(t.widest, std::max(1.0F, 2 * step)) + 1;
          auto const clamped = [](float value, int most) {
            return static_cast<int>(std::clamp(value, 0.0F, static_cast<float>(most)));
          };
          one.left = clamped(std::floor(least_u - reach), width);
          one.right = clamped(std::ceil(most_u + reach) + 1, width);
          one.top = clamped(std::floor(least_v - reach), height);
          one.bottom = clamped(std::ceil(most_v + reach) + 1, height);
          if (one.left >= one.right || one.top >= one.bottom) continue;
        }
        if (tiles) {
          PixelBox const box = tiles->within(one.left, one.right, one.top, one.bottom);
          one.left = std::max(one.left, box.left), one.right = std::min(one.right, box.right);
          one.top = std::max(one.top, box.top), one.bottom = std::min(one.bottom, box.bottom);
          if (one.left >= one.right || one.top >= one.bottom) continue;
        }
        blocks_of[p].push_back(one);
      }
    }
  });
  damaged_.clear();
  for (std::size_t p = 0; p < parts.size(); ++p)
    if (!damage[p].empty()) damaged_.emplace(parts[p].cell, std::move(damage[p]));
  std::vector<std::vector<DrawnBlock>> of_band(bands());
  for (auto const& list : blocks_of)
    for (DrawnBlock const& block : list)
      for (int b = block.top / kBand; b <= (block.bottom - 1) / kBand; ++b) {
        std::size_t const band = static_cast<std::size_t>(b);
        of_band[band].push_back(block);
        if (touched_[band].right == 0) {
          int const rows = std::min(kBand, height - b * kBand);
          std::memset(counts_.data() + band * kBand * stride(), 0, stride() * static_cast<std::size_t>(rows));
        }
        touched_[band].left = std::min(touched_[band].left, block.left);
        touched_[band].right = std::max(touched_[band].right, block.right);
      }
  std::atomic<std::size_t> splats = 0;
  for_each_index(context, of_band.size(), [&](std::size_t band) {
    OutputArea const whole = area(band, stencil);
    std::size_t drawn = 0;
    // Nearest first, so that what is hidden is lost at once; patches after all others.
    std::stable_sort(of_band[band].begin(), of_band[band].end(), [](DrawnBlock const& a, DrawnBlock const& b) {
      return a.fills != b.fills ? b.fills : a.nearest < b.nearest;
    });
    for (DrawnBlock const& block : of_band[band]) {
      DrawnCell const& cell = cells[block.cell];
      OutputArea target = whole;
      if (!stencil.empty()) {
        target.first_x = block.left, target.end_x = block.right;
        target.first_y = std::max(whole.top, block.top), target.end_y = std::min(whole.bottom, block.bottom);
      }
      drawn += draw_splats(cell.pixels, block.first, block.count, cell.transforms[block.face], target);
    }
    splats += drawn;
  });
  return splats;
}

std::size_t SplatCanvas::compose(SplatCanvas const* more, std::uint32_t least_alpha, Frame& frame,
                                 Context& context) const {
  frame.color.create(camera_.height(), camera_.width());
  frame.depth.create(camera_.height(), camera_.width());
  std::atomic<std::size_t> bare = 0;
  for_each_index(context, bands(), [&](std::size_t band) {
    int const top = static_cast<int>(band) * kBand, bottom = std::min(top + kBand, camera_.height());
    SplatCanvas const* first = this;
    SplatCanvas const* second = more;
    if (touched_[band].right == 0 && second != nullptr) std::swap(first, second);
    if (second != nullptr && second->touched_[band].right == 0) second = nullptr;
    Touched touched = first->touched_[band];
    if (second != nullptr) {
      touched.left = std::min(touched.left, second->touched_[band].left);
      touched.right = std::max(touched.right, second->touched_[band].right);
    }
    std::size_t count = 0;
    OutputArea const mine = first->area(band, {});
    OutputArea const others = second != nullptr ? second->area(band, {}) : OutputArea{};
    for (int y = top; y < bottom; ++y) {
      PictureRow const row{static_cast<std::uint32_t*>(static_cast<void*>(frame.color.ptr(y))), frame.depth[y]};
      int const left = std::min(touched.left, touched.right), right = touched.right;
      std::fill(row.color, row.color + left, 0U);
      std::fill(row.color + right, row.color + camera_.width(), 0U);
      std::fill(row.depth, row.depth + left, kMissing);
      std::fill(row.depth + right, row.depth + camera_.width(), kMissing);
      count += static_cast<std::size_t>(camera_.width() - (right - left));
      if (left < right)
        count += compose_splats(mine, second != nullptr ? &others : nullptr, y, left, right, camera_.is_perspective(),
                                least_alpha, row);
    }
    bare += count;
  });
  return bare;
}

void SplatCanvas::fill_beneath(cv::Mat1b const& stencil, Frame& frame, Context& context) const {
  for_each_index(context, bands(), [&](std::size_t band) {
    int const top = static_cast<int>(band) * kBand, bottom = std::min(top + kBand, camera_.height());
    Touched const touched = touched_[band];
    if (touched.left >= touched.right) return;
    OutputArea const mine = area(band, {});
    std::vector<std::uint32_t> colors(static_cast<std::size_t>(camera_.width()));
    std::vector<float> depths(colors.size());
    auto const& linear = linear_from_srgb8();
    for (int y = top; y < bottom; ++y) {
      uchar const* const wanted = stencil.ptr(y);
      if (std::none_of(wanted + touched.left, wanted + touched.right, [](uchar one) { return one != 0; })) continue;
      compose_splats(mine, nullptr, y, touched.left, touched.right, camera_.is_perspective(), 0,
                     {colors.data(), depths.data()});
      for (int x = touched.left; x < touched.right; ++x) {
        std::uint32_t const below = colors[static_cast<std::size_t>(x)];
        // The outline of what is filtered lies where it covers a half.
        double const cover = std::clamp(2 * double(below >> 24) / 255 - 1, 0.0, 1.0);
        if (wanted[x] == 0 || cover == 0) continue;
        cv::Vec4b& pixel = frame.color(y, x);
        double const alpha = pixel[3] / 255.0, share = (1 - alpha) * cover, sum = alpha + share;
        for (int c = 0; c < 3; ++c) {
          double const light = (alpha * linear[pixel[c]] + share * linear[below >> 8 * c & 255]) / sum;
          pixel[c] = static_cast<uchar>(std::lround(255 * srgb_from_linear(light)));
        }
        pixel[3] = static_cast<uchar>(std::lround(255 * sum));
        if (share > alpha) frame.depth(y, x) = depths[static_cast<std::size_t>(x)];
      }
    }
  });
}

}  // namespace scanview
