#include "viewer/visibility/selection_drawer.h"

#include <limits>

#include "viewer/raster/id_buffer.h"

namespace scanview {

SelectionDrawer::SelectionDrawer(TriangleMesh const& drawn)
    : chosen_(raster_mesh(drawn, {})), corners_(chosen_.corners) {
  for (auto const& vertex : drawn.vertices) bounds_.extend(vertex.cast<double>());
}

void SelectionDrawer::draw(SampleCamera const& camera, std::span<IndexRange const> ranges) {
  chosen_.corners.clear();
  chosen_.labels.clear();
  for (IndexRange const& range : ranges) {
    auto const begin = corners_.begin() + 3 * static_cast<std::ptrdiff_t>(range.first);
    chosen_.corners.insert(chosen_.corners.end(), begin, begin + 3 * static_cast<std::ptrdiff_t>(range.count));
    for (std::uint32_t i = 0; i < range.count; ++i) chosen_.labels.push_back(range.first + i);
  }
  auto const pixels =
      static_cast<std::size_t>(camera.camera.width()) * static_cast<std::size_t>(camera.camera.height());
  keys_.assign(pixels, -std::numeric_limits<float>::infinity());
  ids_.resize(pixels);
  DepthRange range;
  if (chosen_.labels.empty() ||
      !depth_range(bounds_, camera.object_from_camera.inverse(), camera.camera.is_perspective(), range))
    return;
  draw_keyed_ids(chosen_, camera.camera, camera.object_from_camera, range, Culling::none,
                 {keys_.data(), ids_.data(), camera.camera.width()});
}

}  // namespace scanview
