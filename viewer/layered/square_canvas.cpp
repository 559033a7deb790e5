#include "viewer/layered/square_canvas.h"

#include <oneapi/tbb/info.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

#include "base/error.h"
#include "base/parallel.h"
#include "base/srgb.h"
#include "viewer/layered/ldi_traversal.h"

namespace scanview {
namespace {

/// A square's side in grid steps, where it is not known how the surface lies.
constexpr double kFacingSide = 1.5;
/// So many grid steps farther a square counts at its edge: of squares of one surface that wins which is best in the
/// middle of the pixel, and outlines are not fatter by half a square. 2 dB better than the nearest alone.
constexpr double kBias = 4;

SquareTransform square_transform(LdiTree const& tree, LdiCell const& cell, int face, Camera const& camera,
                                 Eigen::Isometry3d const& camera_from_object, double near) {
  Eigen::Matrix<double, 3, 4> const rows = screen_from_grid(tree, cell, face, camera, camera_from_object);
  SquareTransform transform;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 4; ++k) transform.rows[i][k] = static_cast<float>(rows(i, k));
  int const axis = face / 2, axes[3] = {(axis + 1) % 3, (axis + 2) % 3, axis};
  double const step = ldi_step(cell.key.level);
  Eigen::Isometry3d const object_from_camera = camera_from_object.inverse();
  Eigen::Vector3d const eye =
      camera.is_perspective()
          ? Eigen::Vector3d((object_from_camera.translation() - ldi_corner(cell.key, tree.options.resolution)) / step)
          : Eigen::Vector3d(object_from_camera.linear().col(2));
  for (int k = 0; k < 3; ++k) transform.eye[k] = static_cast<float>(eye[axes[k]]);
  transform.eye[3] = camera.is_perspective() ? 1 : 0;
  transform.depth_scale = float(tree.options.resolution) / 65536;
  bool const oriented = tree.options.normals == LdiOptions::Normals::measured;
  transform.facing = !oriented ? 0 : face % 2 == 0 ? -1 : 1;
  transform.half = static_cast<float>(kFacingSide / 2 * step * std::sqrt(camera.fx() * camera.fy()));
  transform.bias = static_cast<float>(kBias * step);
  transform.near = static_cast<float>(near);
  transform.perspective = camera.is_perspective();
  return transform;
}

/// sRGB of a square root of linear light in 8 bits.
std::array<std::uint32_t, 256> const& srgb_from_root() {
  static std::array<std::uint32_t, 256> const table = [] {
    std::array<std::uint32_t, 256> values{};
    for (std::size_t i = 0; i < values.size(); ++i)
      values[i] = static_cast<std::uint32_t>(std::lround(255 * srgb_from_linear(double(i * i) / (255 * 255))));
    return values;
  }();
  return table;
}

}  // namespace

std::size_t SquareCanvas::draw(LdiTree const& tree, std::vector<CellPart> const& parts, Camera const& camera,
                               Eigen::Isometry3d const& object_from_camera, Frame& frame, Context& context) {
  Eigen::Isometry3d const camera_from_object = object_from_camera.inverse();
  double const near = nearest_drawn(tree);
  std::size_t const size = static_cast<std::size_t>(camera.width()) * static_cast<std::size_t>(camera.height());
  auto const blocks_of = [&](CellPart const& part) {
    LdiCell const& cell = tree.cells[static_cast<std::size_t>(part.cell)];
    auto const blocks = tree.blocks(cell);
    std::size_t const kind = static_cast<std::size_t>(part.kind);
    std::size_t first = 0;
    for (std::size_t k = 0; k < kind; ++k) first += cell.blocks_of_kind[k];
    return blocks.subspan(first, cell.blocks_of_kind[kind]);
  };
  damaged_.clear();
  std::vector<std::span<LdiBlock const>> blocks_of_part(parts.size());
  std::vector<std::size_t> pixels(parts.size() + 1);  // before each part
  for (std::size_t p = 0; p < parts.size(); ++p) {
    pixels[p + 1] = pixels[p];
    try {
      blocks_of_part[p] = blocks_of(parts[p]);
    } catch (Error const& error) {
      damaged_.emplace(parts[p].cell, error.what());
    }
    auto const blocks = blocks_of_part[p];
    if (!blocks.empty()) pixels[p + 1] += blocks.back().first + blocks.back().count - blocks.front().first;
  }
  std::size_t const processors = static_cast<std::size_t>(oneapi::tbb::info::default_concurrency());
  layers_.resize(context.threads > 0 ? std::min(static_cast<std::size_t>(context.threads), processors) : processors);
  for_each_index(context, layers_.size(), [&](std::size_t k) {
    Layer& layer = layers_[k];
    layer.depth.assign(size, std::numeric_limits<float>::infinity());
    layer.samples.resize(size);
    SquareTarget const target{layer.depth.data(), layer.samples.data(), camera.width(), camera.height()};
    // Every layer takes near and far cells, as many pixels as the others.
    std::size_t const grain = 1 << 14;
    for (std::size_t p = 0; p < parts.size(); ++p) {
      if (pixels[p] / grain % layers_.size() != k) continue;
      LdiCell const& cell = tree.cells[static_cast<std::size_t>(parts[p].cell)];
      auto const blocks = blocks_of_part[p];
      // Blocks of a face follow one another.
      for (std::size_t b = 0; b < blocks.size();) {
        std::size_t end = b;
        std::size_t count = 0;
        while (end < blocks.size() && blocks[end].face == blocks[b].face) count += blocks[end++].count;
        draw_squares(tree.pixels(cell), blocks[b].first, count,
                     square_transform(tree, cell, blocks[b].face, camera, camera_from_object, near), target);
        b = end;
      }
    }
  });
  frame.color.create(camera.height(), camera.width());
  frame.depth.create(camera.height(), camera.width());
  constexpr int kBand = 64;
  auto const& srgb = srgb_from_root();
  for_each_index(context, static_cast<std::size_t>((camera.height() + kBand - 1) / kBand), [&](std::size_t band) {
    std::size_t const begin = band * kBand * static_cast<std::size_t>(camera.width()),
                      end = std::min(size, begin + kBand * static_cast<std::size_t>(camera.width()));
    for (std::size_t i = begin; i < end; ++i) {
      float depth = layers_[0].depth[i];
      SquareSample sample = layers_[0].samples[i];
      for (std::size_t k = 1; k < layers_.size(); ++k) {
        Layer const& other = layers_[k];
        if (other.depth[i] < depth || (other.depth[i] == depth && other.samples[i] < sample))
          depth = other.depth[i], sample = other.samples[i];
      }
      std::size_t const x = i % static_cast<std::size_t>(camera.width()),
                        y = i / static_cast<std::size_t>(camera.width());
      bool const is_there = depth < std::numeric_limits<float>::infinity();
      std::uint32_t const color = sample.color;
      std::uint32_t* const out = static_cast<std::uint32_t*>(static_cast<void*>(frame.color.ptr(static_cast<int>(y))));
      out[x] =
          is_there ? srgb[color >> 16 & 255] | srgb[color >> 8 & 255] << 8 | srgb[color & 255] << 16 | 0xff000000U : 0;
      frame.depth[static_cast<int>(y)][x] = is_there ? sample.depth : kMissing;
    }
  });
  return pixels.back();
}

}  // namespace scanview
