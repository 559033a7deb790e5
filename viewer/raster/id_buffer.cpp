#include "viewer/raster/id_buffer.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>

#include "viewer/raster/kernels.h"

namespace scanview {
namespace {

constexpr float kNothing = -std::numeric_limits<float>::infinity();

void draw_block(RasterMesh const& mesh, ScreenTransform const& transform, Culling culling, cv::Rect const& block,
                KeyedIds const& out) {
  TriangleBins bins;
  bins.begin(mesh, transform, block.width, block.height, culling);
  tbb::parallel_for(std::size_t{0}, bins.vertex_parts(), [&](std::size_t part) { bins.transform(part); });
  tbb::parallel_for(std::size_t{0}, bins.triangle_parts(), [&](std::size_t part) { bins.bin(part); });
  int const across = (block.width + kTileWidth - 1) / kTileWidth, down = (block.height + kTileHeight - 1) / kTileHeight;
  tbb::parallel_for(0, across * down, [&](int tile) {
    constexpr std::size_t kPixels = static_cast<std::size_t>(kTileStride) * kTileHeight;
    std::vector<float> keys(kPixels, kNothing);
    std::vector<std::uint32_t> ids(kPixels);
    std::vector<ScreenTriangle> triangles;
    bins.collect(static_cast<std::size_t>(tile), triangles);
    int const left = tile % across * kTileWidth, top = tile / across * kTileHeight;
    TileArea const area{left, top, std::min(left + kTileWidth, block.width), std::min(top + kTileHeight, block.height)};
    draw_ids(triangles.data(), triangles.size(), area, {keys.data(), ids.data()});
    for (int y = area.top; y < area.bottom; ++y) {
      std::size_t const from = static_cast<std::size_t>(y - top) * kTileStride;
      std::size_t const to = static_cast<std::size_t>(block.y + y) * static_cast<std::size_t>(out.stride) +
                             static_cast<std::size_t>(block.x + area.left);
      auto const count = static_cast<std::size_t>(area.right - area.left);
      std::copy_n(&keys[from], count, out.keys + to);
      std::copy_n(&ids[from], count, out.ids + to);
    }
  });
}

}  // namespace

void draw_keyed_ids(RasterMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                    DepthRange const& range, Culling culling, KeyedIds const& out) {
  for (int y = 0; y < camera.height(); y += kBlock) {
    for (int x = 0; x < camera.width(); x += kBlock) {
      cv::Rect const block(x, y, std::min(kBlock, camera.width() - x), std::min(kBlock, camera.height() - y));
      Camera const part = camera.cropped(x, y, block.width, block.height);
      draw_block(mesh, screen_transform(part, object_from_camera.inverse(), range), culling, block, out);
    }
  }
}

IdBuffer draw_id_buffer(TriangleMesh const& mesh, Camera const& camera, Eigen::Isometry3d const& object_from_camera,
                        Culling culling, int threads) {
  IdBuffer buffer;
  buffer.id = cv::Mat1i(camera.height(), camera.width(), kNoTriangle);
  buffer.depth = cv::Mat1f(camera.height(), camera.width(), std::numeric_limits<float>::quiet_NaN());
  Eigen::AlignedBox3d bounds;
  for (auto const& vertex : mesh.vertices) bounds.extend(vertex.cast<double>());
  DepthRange range;
  if (mesh.triangles.empty() || !depth_range(bounds, object_from_camera.inverse(), camera.is_perspective(), range)) {
    return buffer;
  }
  std::vector<std::uint32_t> ids(mesh.triangles.size());
  for (std::size_t i = 0; i < ids.size(); ++i) ids[i] = static_cast<std::uint32_t>(i);
  RasterMesh const raster = raster_mesh(mesh, std::move(ids));
  cv::Mat1f keys(buffer.depth.size());
  KeyedIds const out{keys.ptr<float>(), buffer.id.ptr<std::uint32_t>(), camera.width()};
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  arena.execute([&] { draw_keyed_ids(raster, camera, object_from_camera, range, culling, out); });
  for (auto key = keys.begin(), end = keys.end(); key != end; ++key) {
    std::ptrdiff_t const at = key - keys.begin();
    if (*key == kNothing) {
      buffer.id.begin()[at] = kNoTriangle;
    } else {
      buffer.depth.begin()[at] = camera.is_perspective() ? 1 / *key : -*key;
    }
  }
  return buffer;
}

}  // namespace scanview
