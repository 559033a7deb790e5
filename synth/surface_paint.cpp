#include "synth/surface_paint.h"

#include <array>

#include "base/srgb.h"

namespace scanview {
namespace {

cv::Vec3b const kPlaster(205, 214, 222);

}  // namespace

Eigen::Vector3f SurfacePaint::at(RayHit const& hit) const {
  Eigen::Vector3i const& t = triangles_[hit.triangle];
  return (1 - hit.u - hit.v) * at_vertex(t[0]) + hit.u * at_vertex(t[1]) + hit.v * at_vertex(t[2]);
}

Eigen::Vector3f SurfacePaint::at_vertex(int vertex) const {
  static std::array<float, 256> const linear = [] {
    std::array<float, 256> table{};
    for (std::size_t i = 0; i < table.size(); ++i) table[i] = static_cast<float>(linear_from_srgb8()[i]);
    return table;
  }();
  cv::Vec3b const bgr = colors_.empty() ? kPlaster : colors_[vertex];
  return {linear[bgr[2]], linear[bgr[1]], linear[bgr[0]]};
}

}  // namespace scanview
