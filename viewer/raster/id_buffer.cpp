#include "viewer/raster/id_buffer.h"

#include <tbb/parallel_for.h>
#include <tbb/task_arena.h>

#include <algorithm>
#include <limits>

#include "viewer/raster/kernels.h"
#include "viewer/view_based/view_transform.h"

namespace scanview {
namespace {

void draw_block(RasterMesh const& mesh, ScreenTransform const& transform, Culling culling, cv::Mat1i id,
                cv::Mat1f depth) {
  TriangleBins bins;
  bins.begin(mesh, transform, id.cols, id.rows, culling);
  tbb::parallel_for(std::size_t{0}, bins.vertex_parts(), [&](std::size_t part) { bins.transform(part); });
  tbb::parallel_for(std::size_t{0}, bins.triangle_parts(), [&](std::size_t part) { bins.bin(part); });
  int const across = (id.cols + kTileWidth - 1) / kTileWidth, down = (id.rows + kTileHeight - 1) / kTileHeight;
  tbb::parallel_for(0, across * down, [&](int tile) {
    constexpr std::size_t kPixels = static_cast<std::size_t>(kTileStride) * kTileHeight;
    constexpr float kNothing = -std::numeric_limits<float>::infinity();
    std::vector<float> keys(kPixels, kNothing);
    std::vector<std::uint32_t> ids(kPixels);
    std::vector<ScreenTriangle> triangles;
    bins.collect(static_cast<std::size_t>(tile), triangles);
    int const left = tile % across * kTileWidth, top = tile / across * kTileHeight;
    TileArea const area{left, top, std::min(left + kTileWidth, id.cols), std::min(top + kTileHeight, id.rows)};
    draw_ids(triangles.data(), triangles.size(), area, {keys.data(), ids.data()});
    for (int y = area.top; y < area.bottom; ++y) {
      for (int x = area.left; x < area.right; ++x) {
        auto const at = static_cast<std::size_t>((y - top) * kTileStride + (x - left));
        if (keys[at] == kNothing) continue;
        id(y, x) = static_cast<std::int32_t>(ids[at]);
        depth(y, x) = transform.perspective ? 1 / keys[at] : -keys[at];
      }
    }
  });
}

}  // namespace

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
  tbb::task_arena arena(threads > 0 ? threads : tbb::task_arena::automatic);
  for (int y = 0; y < camera.height(); y += kBlock) {
    for (int x = 0; x < camera.width(); x += kBlock) {
      cv::Rect const block(x, y, std::min(kBlock, camera.width() - x), std::min(kBlock, camera.height() - y));
      Camera const part = camera.cropped(x, y, block.width, block.height);
      ScreenTransform const transform = screen_transform(part, object_from_camera.inverse(), range);
      arena.execute([&] { draw_block(raster, transform, culling, buffer.id(block), buffer.depth(block)); });
    }
  }
  return buffer;
}

}  // namespace scanview
